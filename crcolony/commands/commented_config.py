"""A config as TOML that explains itself: each setting below its meaning, unit and range.

The meaning is the docstring below the setting where it is declared, the range is that which `crcolony.config.load`
checks, and the unit is the end of its name.
"""

import ast
import inspect
import textwrap
from collections.abc import Iterator

import msgspec
import tomli_w

from crcolony.config import Config, is_group

_WIDTH = 100
_UNITS = {
    "_m_s2": "m/s^2",
    "_m_s": "m/s",
    "_rad_s": "rad/s",
    "_per_s": "1/s",
    "_m2": "m^2",
    "_rad": "rad",
    "_kg": "kg",
    "_m": "m",
    "_s": "s",
}
"""Units by the end of a setting's name; of two ends that fit the longer one counts."""


def commented_toml(config: Config) -> str:
    """Return a config with comments, in ASCII, as TOML that `load` reads back to an equal one."""
    lines = [
        "# All settings of a colony. Any of them may be left out: what is left out has its default.",
        "# It is used with --config FILE.",
        *_format_group(config, ""),
    ]
    return "\n".join(lines) + "\n"


def meanings(kind: type[msgspec.Struct]) -> dict[str, str]:
    """Return the docstrings of the fields of a group of settings."""
    (declared,) = ast.parse(inspect.getsource(kind)).body
    assert isinstance(declared, ast.ClassDef)
    return {
        field.target.id: " ".join(str(text.value.value).split())
        for field, text in zip(declared.body, declared.body[1:], strict=False)
        if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name)
        if isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant)
    }


def unit_of(name: str) -> str:
    """Return the unit of a setting, "" if it has none."""
    return next((unit for end, unit in _UNITS.items() if name.endswith(end)), "")


def format_range(kind: msgspec.inspect.Type) -> str:
    """Return the values that a type allows, as text."""
    match kind:
        case msgspec.inspect.BoolType():
            return "true or false"
        case msgspec.inspect.LiteralType():
            return ", ".join(map(str, kind.values))
        case msgspec.inspect.IntType() | msgspec.inspect.FloatType():
            low = kind.ge if kind.ge is not None else f"above {kind.gt}"
            return f"{low} to {kind.le}"
        case msgspec.inspect.VarTupleType():
            return f"list of: {format_range(kind.item_type)}"
        case msgspec.inspect.TupleType():
            return f"({'; '.join(map(format_range, kind.item_types))})"
    raise TypeError(f"no text for the type {kind}")


def _format_group(group: msgspec.Struct, path: str) -> Iterator[str]:
    texts = meanings(type(group))
    fields = msgspec.structs.fields(group)
    for field in fields:
        if not is_group(field.type):
            name = field.name
            allowed = format_range(msgspec.inspect.type_info(field.type))
            unit = unit_of(name)
            yield ""
            yield from _comment(f"{texts[name]} [{f'{unit}, ' if unit else ''}{allowed}]")
            yield _format_value(name, getattr(group, name))
    for field in fields:
        if is_group(field.type):
            yield ""
            yield ""
            yield from _comment(inspect.getdoc(field.type) or "")
            yield f"[{path}{field.name}]"
            yield from _format_group(getattr(group, field.name), f"{path}{field.name}.")


def _format_value(name: str, value: object) -> str:
    """Return a setting on one line: tomli_w puts every entry of a list on its own."""
    return " ".join(tomli_w.dumps({name: msgspec.to_builtins(value)}).split())


def _comment(text: str) -> list[str]:
    return [f"# {line}" for line in textwrap.wrap(" ".join(text.split()), _WIDTH - 2)]
