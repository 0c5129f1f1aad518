"""The OpenAPI description: FastAPI's, made complete with what the routes read and raise by themselves."""

from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from pydantic import BaseModel
from pydantic.json_schema import JsonSchemaMode, models_json_schema

from fervor.server.problems import Problem
from fervor.server.scoring_models import ScoreRequest
from fervor.server.scoring_progress import LINES

REFERENCE = "#/components/schemas/{model}"

REPLACED = ("HTTPValidationError", "ValidationError")
"""FastAPI's own form of errors, which the service does not use."""

BEARER = {"type": "http", "scheme": "bearer", "description": "needed where the service has tokens"}


def describe(app: FastAPI) -> dict[str, Any]:
    """The OpenAPI document of an application."""
    document = get_openapi(
        title=app.title,
        version=app.version,
        openapi_version=app.openapi_version,
        summary=app.summary,
        license_info=app.license_info,
        routes=app.routes,
    )
    models: list[tuple[type[BaseModel], JsonSchemaMode]] = [(ScoreRequest, "validation")]
    models += [(model, "serialization") for model in (Problem, *LINES)]
    _, extra = models_json_schema(models, ref_template=REFERENCE)
    components = document.setdefault("components", {})
    schemas = components.setdefault("schemas", {})
    for name, schema in extra["$defs"].items():
        schemas.setdefault(name, schema)
    for name in REPLACED:
        schemas.pop(name, None)
    components["securitySchemes"] = {"bearer": BEARER}
    for path, methods in document["paths"].items():
        if path.startswith("/v1/"):
            for operation in methods.values():
                operation["security"] = [{}, {"bearer": []}]
    return document
