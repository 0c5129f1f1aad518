"""Writes ONNX nodes one by one: a name in, a name out."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import onnx
from onnx import helper, numpy_helper

LANES = 16
"""Floats in the widest vector register; axes padded to it have no scalar tail."""


class GraphBuilder:
    """Collects nodes and initialisers; every method gives the name of the tensor it made."""

    def __init__(self) -> None:
        self.nodes: list[onnx.NodeProto] = []
        self.initializers: dict[str, onnx.TensorProto] = {}

    def constant(self, name: str, value: npt.ArrayLike, dtype: npt.DTypeLike = np.float32) -> str:
        """An initialiser; asking again for the same name and value gives the same one."""
        self.initializers[name] = numpy_helper.from_array(np.asarray(value, dtype, order="C"), name)
        return name

    def indices(self, *values: int) -> str:
        """A one-dimensional int64 initialiser named after its values."""
        return self.constant("indices." + "_".join(map(str, values)), values, np.int64)

    def number(self, value: float) -> str:
        """A float32 scalar named after its value."""
        return self.constant(f"number.{value:g}", np.float32(value))

    def op(self, kind: str, *inputs: str, name: str, **attributes: Any) -> str:
        """A node with one output, called `name`."""
        self.nodes.append(helper.make_node(kind, list(inputs), [name], name=name, **attributes))
        return name

    def slice(self, tensor: str, start: int, stop: int, axis: int, *, name: str) -> str:
        """tensor[start:stop] along one axis."""
        return self.op("Slice", tensor, self.indices(start), self.indices(stop), self.indices(axis), name=name)

    def columns(self, tensor: str, columns: Sequence[int], *, name: str) -> str:
        """tensor[..., columns]."""
        return self.op("Gather", tensor, self.indices(*columns), name=name, axis=-1)


def atan2(build: GraphBuilder, y: str, x: str, *, name: str) -> str:
    """The angle of (x, y) as the C library has it, 0 at the origin; the element count must be a multiple of `LANES`.

    Atan sees only ratios of the smaller to the larger side, so nothing divides by zero. 1/y < 0 also tells -0 from 0.
    """
    zero, one = build.number(0), build.number(1)
    rise, run = build.op("Abs", y, name=f"{name}.rise"), build.op("Abs", x, name=f"{name}.run")
    small, large = build.op("Min", rise, run, name=f"{name}.small"), build.op("Max", rise, run, name=f"{name}.large")
    origin = build.op("Equal", large, zero, name=f"{name}.origin")
    divisor = build.op("Where", origin, one, large, name=f"{name}.divisor")
    angle = build.op("Atan", build.op("Div", small, divisor, name=f"{name}.ratio"), name=f"{name}.octant")
    steep = build.op("Greater", rise, run, name=f"{name}.steep")
    rest = build.op("Sub", build.number(np.pi / 2), angle, name=f"{name}.complement")
    angle = build.op("Where", steep, rest, angle, name=f"{name}.quadrant")
    left = build.op("Less", x, zero, name=f"{name}.left")
    angle = build.op("Where", left, build.op("Sub", build.number(np.pi), angle, name=f"{name}.supplement"), angle,
                     name=f"{name}.half")  # fmt: skip
    below = build.op("Less", build.op("Div", one, y, name=f"{name}.reciprocal"), zero, name=f"{name}.below")
    angle = build.op("Where", below, build.op("Neg", angle, name=f"{name}.negated"), angle, name=f"{name}.signed")
    return build.op("Where", origin, zero, angle, name=name)
