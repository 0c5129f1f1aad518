"""The Kubernetes manifests, built by kubectl as a user would and checked without a cluster."""

import re
import shutil
import subprocess
from typing import Any

import httpx
import pytest

from containers import need, need_module, which
from fervor.settings import ENV_PREFIX, Settings
from live import Live
from pages import ROOT

MANIFESTS = ROOT / "deploy" / "kubernetes"

VERSIONS = ("1.31", "1.34", "1.37")
"""The oldest Kubernetes that the manifests are for, and some newer ones."""

Resource = dict[str, Any]


@pytest.fixture(scope="module")
def resources(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Resource]:
    """What the example is built to, by kind."""
    need("kubectl")
    yaml = need_module("yaml")
    folder = tmp_path_factory.mktemp("made") / "kubernetes"
    shutil.copytree(MANIFESTS, folder)
    for secret in ("checkpoint-keys", "tokens"):
        (folder / "example" / secret).write_text("a secret of at least sixteen characters\n", encoding="utf-8")
    command = [str(which("kubectl")), "kustomize", str(folder / "example")]
    built = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    found = list(yaml.safe_load_all(built))
    assert len({resource["kind"] for resource in found}) == len(found)
    return {resource["kind"]: resource for resource in found}


@pytest.fixture(scope="module")
def pod(resources: dict[str, Resource]) -> Resource:
    spec: Resource = resources["Deployment"]["spec"]["template"]["spec"]
    return spec


@pytest.fixture(scope="module")
def container(pod: Resource) -> Resource:
    (only,) = pod["containers"]
    return dict(only)


@pytest.mark.parametrize("version", VERSIONS)
def test_all_resources_are_valid(resources: dict[str, Resource], version: str) -> None:
    validate = need_module("kubernetes_validate")
    for kind, resource in resources.items():
        if kind != "ServiceMonitor":  # the Prometheus operator's, not Kubernetes'
            validate.validate(resource, version, strict=True)


def test_the_container_may_do_nothing_but_serve(pod: Resource, container: Resource) -> None:
    assert pod["securityContext"]["runAsNonRoot"]
    assert pod["securityContext"]["seccompProfile"] == {"type": "RuntimeDefault"}
    assert not pod["automountServiceAccountToken"]
    assert container["securityContext"] == {
        "allowPrivilegeEscalation": False,
        "readOnlyRootFilesystem": True,
        "capabilities": {"drop": ["ALL"]},
    }
    dockerfile = (ROOT / "Dockerfile").read_text(encoding="utf-8")
    assert f"USER {pod['securityContext']['runAsUser']}:{pod['securityContext']['runAsGroup']}\n" in dockerfile


def test_nothing_is_written_to_a_disk_and_nothing_goes_out(resources: dict[str, Resource], pod: Resource) -> None:
    assert all(volume.keys() & {"secret"} or volume["emptyDir"]["medium"] == "Memory" for volume in pod["volumes"])
    assert resources["NetworkPolicy"]["spec"]["egress"] == []
    assert "Egress" in resources["NetworkPolicy"]["spec"]["policyTypes"]


def test_a_drain_has_the_time_it_may_take(pod: Resource, container: Resource) -> None:
    settings = Settings.load()
    longest = settings.drain_s + settings.shutdown_grace_s + container["lifecycle"]["preStop"]["sleep"]["seconds"]
    assert pod["terminationGracePeriodSeconds"] > longest


def test_an_update_never_leaves_less_than_there_was(resources: dict[str, Resource]) -> None:
    assert resources["Deployment"]["spec"]["strategy"]["rollingUpdate"]["maxUnavailable"] == 0
    assert "replicas" not in resources["Deployment"]["spec"], "an update would undo what the autoscaler did"
    assert resources["HorizontalPodAutoscaler"]["spec"]["minReplicas"] >= 2


def test_every_variable_is_a_setting_and_its_files_are_in_the_secret(
    resources: dict[str, Resource], pod: Resource, container: Resource
) -> None:
    assert not pod["enableServiceLinks"]  # FERVOR_PORT would be an address
    (mount,) = (mount for mount in container["volumeMounts"] if mount["name"] == "secrets")
    for variable in container["env"]:
        assert variable["name"].removeprefix(ENV_PREFIX).lower() in Settings.model_fields
        folder, _, file = variable["value"].rpartition("/")
        assert folder == mount["mountPath"]
        assert file in resources["Secret"]["data"]


def test_probes_ask_what_the_service_answers(container: Resource, http: httpx.Client) -> None:
    assert container["ports"] == [{"name": "http", "containerPort": Settings.load().port}]
    for probe in ("startupProbe", "readinessProbe", "livenessProbe"):
        assert container[probe]["httpGet"]["port"] == "http"
        assert http.get(container[probe]["httpGet"]["path"]).status_code == 200


def test_everything_that_selects_pods_finds_these(resources: dict[str, Resource]) -> None:
    labels = resources["Deployment"]["spec"]["template"]["metadata"]["labels"]
    spread = resources["Deployment"]["spec"]["template"]["spec"]["topologySpreadConstraints"]
    selectors = [
        resources["Deployment"]["spec"]["selector"]["matchLabels"],
        resources["Service"]["spec"]["selector"],
        resources["PodDisruptionBudget"]["spec"]["selector"]["matchLabels"],
        resources["NetworkPolicy"]["spec"]["podSelector"]["matchLabels"],
        *(constraint["labelSelector"]["matchLabels"] for constraint in spread),
    ]
    assert all(selector and selector.items() <= labels.items() for selector in selectors)
    monitored = resources["ServiceMonitor"]["spec"]["selector"]["matchLabels"]
    assert monitored.items() <= resources["Service"]["metadata"]["labels"].items()


def test_the_ingress_lets_streams_in_and_keeps_metrics_inside(resources: dict[str, Resource], live: Live) -> None:
    ingress = resources["Ingress"]
    (rule,) = ingress["spec"]["rules"]
    assert [path["path"] for path in rule["http"]["paths"]] == ["/v1"]
    assert live.stream.endswith("/v1/stream")
    assert ingress["metadata"]["annotations"]["haproxy.org/load-balance"] == "leastconn"
    assert ingress["spec"]["tls"][0]["hosts"] == [rule["host"]]


def test_the_autoscaler_counts_a_metric_that_the_service_has(
    resources: dict[str, Resource], http: httpx.Client
) -> None:
    (metric,) = resources["HorizontalPodAutoscaler"]["spec"]["metrics"]
    name = metric["pods"]["metric"]["name"]
    assert re.search(rf"^{name} ", http.get("/metrics").text, re.MULTILINE)
    rules = need_module("yaml").safe_load((MANIFESTS / "prometheus-adapter.yaml").read_text(encoding="utf-8"))
    (rule,) = rules["rules"]["custom"]
    assert rule["seriesQuery"].startswith(name + "{")
    assert rule["name"]["as"] == name
