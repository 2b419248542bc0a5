"""Records: classes that hold named fields.

``dataclasses.dataclass`` compiles functions for every class it is put on, about half a millisecond each; for all the
records of a run that is as long as refining a small mesh takes. A ``record`` is written the same way and has the same
``__init__``, but one that serves every class: nothing is compiled, and nothing else is added.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar

T = TypeVar("T")


class _Made:
    """A default that is made anew for each record."""

    def __init__(self, make: Callable[[], Any]) -> None:
        self.make = make


def field(*, default_factory: Callable[[], T]) -> T:
    """A field whose default is made anew for each record."""
    return _Made(default_factory)  # type: ignore[return-value]


if TYPE_CHECKING:
    from typing_extensions import dataclass_transform
else:

    def dataclass_transform(**_: Any) -> Callable[[T], T]:
        """Tell type checkers what ``record`` does; at run time, nothing."""
        return lambda function: function


@dataclass_transform(eq_default=False, field_specifiers=(field,))
def record(cls: type[T]) -> type[T]:
    """Give a class an ``__init__`` that takes its annotated fields, in order or by name.

    Raises TypeError, when a record is made, for a field that is missing, unknown or given twice.
    """
    names = tuple(cls.__annotations__)
    defaults = {name: cls.__dict__[name] for name in names if name in cls.__dict__}

    def __init__(self: Any, *values: Any, **named: Any) -> None:  # noqa: N807
        if len(values) > len(names):
            raise TypeError(f"{cls.__name__} has {len(names)} fields, not {len(values)}")
        held = self.__dict__
        held.update(zip(names, values, strict=False))
        for name in names[len(values) :]:
            if name in named:
                held[name] = named.pop(name)
            elif name in defaults:
                default = defaults[name]
                held[name] = default.make() if isinstance(default, _Made) else default
            else:
                raise TypeError(f"{cls.__name__} needs its field {name!r}")
        if named:
            raise TypeError(f"{cls.__name__} has no field {next(iter(named))!r} left to set")

    cls.__init__ = __init__  # type: ignore[method-assign]
    return cls


def replaced(original: T, **changes: Any) -> T:
    """A copy of a record that differs in the named fields."""
    names = type(original).__annotations__
    return type(original)(**{name: getattr(original, name) for name in names} | changes)
