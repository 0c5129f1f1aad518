"""`fervor serve`: the service. Its options are the settings."""

import inspect
import os
from typing import Annotated, Any, get_args

import typer

# The service has one thread a process; OpenBLAS, which comes with numpy, starts one a core when it is imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from fervor.cli.loading import built_when_used, uncollected
from fervor.settings import Settings, is_option, option_name


def serve(**options: Any) -> None:
    """Run the service until it is stopped.

    Every option can be set in the environment too: --max-bodies is FERVOR_MAX_BODIES. Secrets (FERVOR_TOKENS) can be
    set only there.
    """
    settings = Settings.load(**options)
    with uncollected():  # until all is loaded: see `leave_alone_what_is_loaded`
        with built_when_used():
            from fervor.server.run import run

        run(settings)


def _signature() -> inspect.Signature:
    """One option per setting, without a default of its own: what is not given comes from the environment."""
    parameters = []
    for name, setting in Settings.model_fields.items():
        if not is_option(name):
            continue
        described = f"{(setting.description or name)[0].upper()}{(setting.description or name)[1:]}"
        shown = False if setting.default is None else str(setting.default)
        option = typer.Option(option_name(name), help=described, metavar=_kind(setting.annotation), show_default=shown)
        annotation = Annotated[str | None, option]
        parameters.append(inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=annotation))
    return inspect.Signature(parameters)


def _kind(annotation: Any) -> str:
    """What the help calls a value of this type."""
    choices = get_args(annotation)
    if choices and all(isinstance(choice, str) for choice in choices):
        return "|".join(choices)
    return {int: "NUMBER", float: "NUMBER", str: "TEXT", tuple[str, ...]: "TEXT"}.get(annotation, "FILE")


serve.__signature__ = _signature()  # type: ignore[attr-defined]  # how typer learns a function's options
serve.__annotations__ = {name: parameter.annotation for name, parameter in _signature().parameters.items()}
