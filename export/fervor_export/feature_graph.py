"""The nodes that compute `features` inside the model file: the same tables, the same order of operations."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from onnx import TensorProto

from fervor.metadata import MASK, ROTATIONS
from fervor.skeletons.rig import JOINTS
from fervor_export import features
from fervor_export.builder import LANES, GraphBuilder, atan2
from fervor_export.network import NetworkConfig


def feature_nodes(build: GraphBuilder, config: NetworkConfig) -> tuple[str, dict[str, str]]:
    """Features [batch, time, feature], and what becomes of the states they need."""
    norm2 = _matmul(build, build.op("Mul", ROTATIONS, ROTATIONS, name="squares"), np.ones((4, 4)), name="norm2")
    smallest, largest = build.number(features.SMALLEST_NORM2), build.number(features.LARGEST_NORM2)
    clipped = build.op("Clip", norm2, smallest, largest, name="norm2.clipped")
    sound = build.op("Equal", norm2, clipped, name="sound")  # false for NaN
    mask = build.op("Unsqueeze", MASK, build.indices(-1), name="mask.column")
    unmasked = build.op(
        "Greater", _matmul(build, mask, np.ones((1, 4)), name="mask.four"), build.number(0.5), name="unmasked"
    )
    seen = build.op("And", sound, unmasked, name="seen")  # [batch, time, 13, 4], four times the same
    if config.features == "euler":
        return _euler(build, seen), {}
    unit = build.op("Div", ROTATIONS, build.op("Sqrt", clipped, name="norm"), name="unit")
    q = build.op("Where", seen, unit, build.number(0), name="q")
    return _rot6d_velocity(build, q, seen, config.rate_hz)


def _matmul(build: GraphBuilder, tensor: str, table: npt.ArrayLike, *, name: str) -> str:
    """A matrix product with a constant, which is called after the result."""
    return build.op("MatMul", tensor, build.constant(f"{name}.table", table), name=name)


def _products(build: GraphBuilder, p: str, q: str, pairs: Sequence[str], *, name: str) -> str:
    """Products of a component of p and one of q: [..., pair]."""
    left = _matmul(build, p, features.picks(pairs, 0), name=f"{name}.left")
    right = _matmul(build, q, features.picks(pairs, 1), name=f"{name}.right")
    return build.op("Mul", left, right, name=name)


def _rot6d_velocity(build: GraphBuilder, q: str, seen: str, rate_hz: float) -> tuple[str, dict[str, str]]:
    """See `features.rot6d_velocity`; q holds unit quaternions, zero where unseen."""
    rot6d = _matmul(build, _products(build, q, q, features.PAIRS, name="pairs"), features.ROT6D, name="rot6d")
    first = build.op("Unsqueeze", "previous", build.indices(1), name="p.first")
    p = build.op("Concat", first, build.slice(q, 0, -1, 1, name="p.rest"), name="p", axis=1)
    cross = _products(build, p, q, features.CROSS, name="cross")
    relative = _matmul(build, cross, features.relative_scaled(rate_hz), name="relative")  # [batch, time, 13, 6]
    w = build.slice(relative, 3, 6, -1, name="relative.w")
    sign = build.op("Clip", w, build.number(-1), build.number(1), name="relative.sign")
    velocity = build.op("Mul", build.slice(relative, 0, 3, -1, name="relative.vector"), sign, name="velocity")
    flag = build.op("Cast", build.slice(seen, 0, 1, -1, name="seen.once"), name="seen.flag", to=TensorProto.FLOAT)
    by_joint = build.op("Concat", rot6d, velocity, flag, name="features.by_joint", axis=-1)  # [batch, time, 13, 10]
    last = build.op("Gather", q, build.constant("last", -1, np.int64), name="q.last", axis=1)
    shape = build.indices(0, 0, features.width("rot6d+velocity"))
    return build.op("Reshape", by_joint, shape, name="features"), {"previous": last}


def _euler(build: GraphBuilder, seen: str) -> str:
    """See `features.euler`; the joint axis is padded to 16 joints, cut back at the end."""
    seen_q = build.op("Where", seen, ROTATIONS, build.number(0), name="q.seen")
    pads = build.indices(0, 0, 0, 0, 0, 0, LANES - len(JOINTS), 0)
    q = build.op("Pad", seen_q, pads, name="q")
    # Gather keeps the sign of zero, which a matrix product would not; see `features.euler_terms`.
    left = build.columns(q, features.factors(features.PAIRS, 0), name="pairs.left")
    right = build.columns(q, features.factors(features.PAIRS, 1), name="pairs.right")
    products = build.op("Mul", left, right, name="pairs")  # [batch, time, 16, 10]
    total = ""
    for row, (index, factor) in enumerate(zip(*features.euler_terms(), strict=True)):
        picked = build.columns(products, index.tolist(), name=f"euler.picked{row}")
        term = build.op("Mul", picked, build.constant(f"features.euler.factor{row}", factor), name=f"euler.term{row}")
        total = build.op("Add", total, term, name=f"euler.sum{row}") if total else term
    angles = _angles(build, total)
    cut = build.slice(angles, 0, len(JOINTS), 2, name="angles.joints")
    return build.op("Reshape", cut, build.indices(0, 0, features.width("euler")), name="features")


def _angles(build: GraphBuilder, sums: str) -> str:
    """Roll, pitch, yaw [..., 3] from `features.EULER_SUMS` [..., 8]."""
    yaw_x, yaw_y = build.columns(sums, [5], name="yaw.x"), build.columns(sums, [2], name="yaw.y")
    xx, yy = build.op("Mul", yaw_x, yaw_x, name="yaw.xx"), build.op("Mul", yaw_y, yaw_y, name="yaw.yy")
    cos2 = build.op("Add", xx, yy, name="pitch.cos2")
    norm2 = build.columns(sums, [7], name="sums.norm2")
    norm4 = build.op("Mul", norm2, norm2, name="sums.norm4")
    least = build.op("Mul", norm4, build.number(features.LOCK), name="pitch.least")
    lock = build.op("LessOrEqual", cos2, least, name="lock")
    cos = build.op("Sqrt", cos2, name="pitch.cos")
    zero, one = build.number(0), build.number(1)
    y = build.op("Where", lock, build.columns(sums, [3], name="lock.y"), yaw_y, name="yaw.y.any")
    x = build.op("Where", lock, build.columns(sums, [6], name="lock.x"), yaw_x, name="yaw.x.any")
    roll_y = build.op("Where", lock, zero, build.columns(sums, [0], name="roll.y"), name="roll.y.any")
    roll_x = build.op("Where", lock, one, build.columns(sums, [4], name="roll.x"), name="roll.x.any")
    pitch_y = build.columns(sums, [1], name="pitch.y")
    ys = build.op("Concat", roll_y, pitch_y, y, name="angles.y", axis=-1)
    xs = build.op("Concat", roll_x, cos, x, name="angles.x", axis=-1)
    return atan2(build, ys, xs, name="angles")
