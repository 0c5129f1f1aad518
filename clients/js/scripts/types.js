// Writes the types of the messages, made from the AsyncAPI document that the service generates from its models.
// Run by `npm run types`; FERVOR_PYTHON names a Python that has fervor installed, where that is not the source's own.

import { execFileSync } from "node:child_process";
import { fileURLToPath } from "node:url";
import { compile } from "json-schema-to-typescript";

const PYTHON = process.env.FERVOR_PYTHON ?? fileURLToPath(new URL("../../../.venv/bin/python", import.meta.url));
const PRINT = "import json; from fervor.protocol.asyncapi import asyncapi; print(json.dumps(asyncapi('')))";
const HEAD =
  "// Messages of `GET /v1/stream`, made from its AsyncAPI document by `npm run types`: do not edit.\n" +
  "// Fields that the service may leave out are there all the same: see DEFAULTS.\n";

/** A schema without titles of fields, each of which would become a type, and without bounds that no type can say. */
function plain(schema) {
  if (Array.isArray(schema)) return schema.map(plain);
  if (schema === null || typeof schema !== "object") return schema;
  const { title, minItems, maxItems, ...rest } = schema;
  if (minItems !== undefined && minItems === maxItems) {
    if (rest.items.type !== "number") throw new Error(`a tuple of ${rest.items.type} needs another form`);
    return { description: rest.description, tsType: `[${Array(minItems).fill("number").join(", ")}]` };
  }
  return Object.fromEntries(
    Object.entries(rest).map(([key, value]) => [key, key === "properties" ? each(value, plain) : plain(value)]),
  );
}

const each = (object, change) =>
  Object.fromEntries(Object.entries(object).map(([key, value]) => [key, change(value, key)]));

/** What the service says: fields that are not known are passed over there, and refused elsewhere. */
const isAnswer = (schema) => schema.type === "object" && schema.additionalProperties !== false;

/** A message brings its type; an answer has all its fields, for what is left out is filled in. */
function withRequired(schema) {
  if (schema.type !== "object") return schema;
  const required = isAnswer(schema) ? Object.keys(schema.properties) : (schema.required ?? []);
  return { ...schema, required: "type" in schema.properties ? ["type", ...required] : required };
}

const defaults = (schema) =>
  Object.fromEntries(
    Object.entries(schema.properties)
      .filter(([key, field]) => key !== "type" && "default" in field)
      .map(([key, field]) => [key, field.default]),
  );

const document = JSON.parse(
  execFileSync(PYTHON, ["-c", PRINT], { encoding: "utf8" }).replaceAll("#/components/schemas/", "#/definitions/"),
);
const { schemas } = document.components;
const sides = Object.values(document.operations).map(({ action, summary, messages }) => [
  action === "receive" ? "ClientMessage" : "ServerMessage", // of the service's actions
  { description: summary, oneOf: messages.map(({ $ref }) => ({ $ref: `#/definitions/${$ref.split("/").at(-1)}` })) },
]);
const definitions = {
  ...each(schemas, (schema, title) => ({ title, ...withRequired(plain(schema)) })),
  ...Object.fromEntries(sides),
  Raw: { title: "Raw", description: schemas.Raw.description, tsType: "Uint8Array" },
};
const types = await compile({ title: "Messages", definitions }, "Messages", {
  additionalProperties: false,
  bannerComment: HEAD,
  format: false,
  unreachableDefinitions: true,
});
const filled = each(Object.fromEntries(Object.entries(schemas).filter(([, schema]) => isAnswer(schema))), defaults);
process.stdout.write(
  types
    .replace(/ \* ?\n \* This interface was referenced by .*\n \* via .*\n/g, "") // the document is our own scaffold
    .replace(/\/\*\*\n \* This interface was referenced by .*\n \* via .*\n \*\/\n/g, "")
    .replace(/export interface Messages \{[^}]*\}\n/, ""),
);
process.stdout.write(`\n\n/** What stands for the fields that the service may leave out. */
export const DEFAULTS = ${JSON.stringify(Object.fromEntries(Object.entries(filled).filter(([, value]) => Object.keys(value).length)))};\n`);
