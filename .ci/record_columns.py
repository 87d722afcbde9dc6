"""mypy plugin: a column of a record array by its name, `rows["t_us"]`, is one signature.

numpy's stubs have seven, and mypy matches all of them anew for each of the 40 signatures of an
operator between two such columns: 0.4 s a line.

The collector of cycles, which took a third of the time, runs less often: what mypy makes stays.
"""

import gc
from collections.abc import Callable

from mypy.nodes import NameExpr, StrExpr, Var
from mypy.plugin import MethodSigContext, Plugin
from mypy.types import AnyType, FunctionLike, Instance, ProperType, TypeOfAny, get_proper_type

NEW_OBJECTS = 10_000_000  # between two runs of the collector; mypy says 200 000
NUMPY, GETITEM = "numpy.ndarray", "numpy.ndarray.__getitem__"


def one_column(context: MethodSigContext) -> FunctionLike:
    """Return the signature of a column where a record is asked for one, else what numpy says."""
    asked, array = context.args[0][0], get_proper_type(context.type)
    if not (isinstance(array, Instance) and array.type.fullname == NUMPY and is_text(asked)):
        return context.default_signature
    dtype = get_proper_type(array.args[1])
    if not isinstance(dtype, Instance):
        return context.default_signature
    kind = get_proper_type(dtype.args[0])
    if not isinstance(kind, AnyType) and not is_class(kind, "numpy.void"):
        return context.default_signature
    column = dtype.copy_modified(args=[AnyType(TypeOfAny.explicit)])
    return context.default_signature.copy_modified(
        arg_types=[context.api.named_generic_type("builtins.str", [])],
        ret_type=array.copy_modified(args=[array.args[0], column]),
        variables=[],
    )


def is_class(kind: ProperType, name: str) -> bool:
    """Return whether a type is one of that class."""
    return isinstance(kind, Instance) and kind.type.fullname == name


def is_text(asked: object) -> bool:
    """Return whether an index is a literal or a name of text."""
    if isinstance(asked, NameExpr) and isinstance(asked.node, Var) and asked.node.type is not None:
        return is_class(get_proper_type(asked.node.type), "builtins.str")
    return isinstance(asked, StrExpr)


class RecordColumns(Plugin):
    """Hook into indexing of numpy's arrays."""

    def get_method_signature_hook(
        self, fullname: str
    ) -> Callable[[MethodSigContext], FunctionLike] | None:
        """Return the hook for `ndarray[...]`."""
        return one_column if fullname == GETITEM else None


def plugin(version: str) -> type[Plugin]:
    """Return the plugin: mypy calls this when it has set the collector's threshold itself."""
    gc.set_threshold(NEW_OBJECTS)
    return RecordColumns
