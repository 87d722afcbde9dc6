"""Expressions of a user's model: grammar, exact slopes, machine code.

The face of the room: outside of `host.sysid` these names are imported from here.
"""

from host.faces import lazily

TYPE_CHECKING = False
if TYPE_CHECKING:
    from host.sysid.expressions.equation_code import EquationNodes
    from host.sysid.expressions.evaluation import evaluate
    from host.sysid.expressions.grammar import parse_expression

__all__ = [
    "EquationNodes",
    "evaluate",
    "parse_expression",
]

__getattr__ = lazily(
    __name__,
    {
        "EquationNodes": "equation_code",
        "evaluate": "evaluation",
        "parse_expression": "grammar",
    },
)
