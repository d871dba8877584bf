"""A function for each model solid of the library."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

from ._native import Solid, generate, kinds


def _text(value: Any) -> str:
    """Returns a value as the command line takes it: 3, 0.5, 1,2,3."""
    if isinstance(value, str):
        return value
    if hasattr(value, "__iter__"):
        return ",".join(_text(part) for part in value)
    return repr(int(value)) if float(value).is_integer() else repr(float(value))


def _value(text: str) -> Any:
    """Returns a default as a Python value."""
    try:
        parts = [float(part) for part in text.split(",")]
    except ValueError:
        return text
    numbers = [int(part) if part.is_integer() else part for part in parts]
    return numbers[0] if len(numbers) == 1 else tuple(numbers)


def _function(kind: str, summary: str, parameters: list[tuple[str, str, str]]) -> Callable[..., Solid]:
    names = {name.replace("-", "_"): name for name, _, _ in parameters}
    keyword = inspect.Parameter.KEYWORD_ONLY
    signature = inspect.Signature(
        [
            inspect.Parameter(python, keyword, default=_value(default))
            for python, (_, default, _) in zip(names, parameters, strict=True)
        ],
        return_annotation=Solid,
    )

    def build(**values: Any) -> Solid:
        unknown = set(values) - set(names)
        if unknown:
            raise TypeError(f"{kind} has no parameter {', '.join(sorted(unknown))}; it has {', '.join(names)}")
        given = signature.bind(**values).arguments
        return generate(kind, [(names[name], _text(value)) for name, value in given.items()])

    build.__name__ = build.__qualname__ = kind.replace("-", "_")
    build.__module__ = "ldi_ops"
    build.__signature__ = signature  # type: ignore[attr-defined]
    meanings = "\n".join(f"    {name}: {meaning.replace('with commas', 'as a tuple')}" for name, (_, _, meaning) in zip(names, parameters, strict=True))
    build.__doc__ = f"{summary[0].upper()}{summary[1:]}. The unit is mm.\n\nParameters:\n{meanings}\n"
    return build


FUNCTIONS: dict[str, Callable[..., Solid]] = {
    kind.replace("-", "_"): _function(kind, summary, parameters) for kind, summary, parameters in kinds()
}
