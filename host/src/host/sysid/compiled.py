"""Types of arrays, under the name that modules of this folder have for them."""

from host.compiled import Array, BoolArray, IntArray

__all__ = ["Array", "BoolArray", "IntArray"]
