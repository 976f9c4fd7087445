"""A check of JSON values against a JSON Schema, as far as ``json_schema`` uses the language."""

from __future__ import annotations

from typing import Any

_TYPES: dict[str, tuple[type, ...]] = {
    "object": (dict,),
    "array": (list,),
    "string": (str,),
    "integer": (int,),
    "number": (int, float),
    "boolean": (bool,),
    "null": (type(None),),
}
_KNOWN = {
    *("$ref", "$defs", "title", "description", "default", "type", "properties", "required", "additionalProperties"),
    *("items", "prefixItems", "minItems", "maxItems", "anyOf", "enum"),
}


def check_against_schema(value: Any, schema: dict[str, Any]) -> None:
    """Raise AssertionError, with the place in the value, where it does not fit the schema."""
    _check(value, schema, schema.get("$defs", {}), "$")


def _check(value: Any, schema: dict[str, Any], definitions: dict[str, Any], place: str) -> None:
    assert schema.keys() <= _KNOWN, f"not understood here: {schema.keys() - _KNOWN}"
    if "$ref" in schema:
        _check(value, definitions[schema["$ref"].rpartition("/")[2]], definitions, place)
    if "anyOf" in schema:
        _check_any(value, schema["anyOf"], definitions, place)
    if "enum" in schema:
        assert value in schema["enum"], f"{place}: {value!r} is none of {schema['enum']}"
    if "type" in schema:
        # exact types: Python's bool is an int, JSON's is no number
        assert type(value) in _TYPES[schema["type"]], f"{place}: {value!r} is no {schema['type']}"
    if isinstance(value, dict):
        missing = set(schema.get("required", ())) - value.keys()
        assert not missing, f"{place}: {missing} missing"
        for key, entry in value.items():
            inner = schema.get("properties", {}).get(key, schema.get("additionalProperties", {}))
            _check(entry, inner, definitions, f"{place}.{key}")
    if isinstance(value, list):
        assert schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", len(value)), f"{place}: {len(value)}"
        first = schema.get("prefixItems", [])
        for index, entry in enumerate(value):
            inner = first[index] if index < len(first) else schema.get("items") or {}
            _check(entry, inner, definitions, f"{place}[{index}]")


def _check_any(value: Any, schemas: list[dict[str, Any]], definitions: dict[str, Any], place: str) -> None:
    problems = []
    for schema in schemas:
        try:
            _check(value, schema, definitions, place)
            return
        except AssertionError as problem:
            problems.append(str(problem))
    raise AssertionError(" and ".join(problems))
