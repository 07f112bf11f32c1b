"""Makes the small models of the tests, beside this file: `python make.py`.

`joints.onnx` finds the joints of a drawn person: each joint has a colour of its own, and the map of a joint is high
where the picture has that colour. Nothing was trained. `net.onnx` has random weights (seed 1) in the layers that
small networks of pictures have. `palms.onnx` finds an upright palm in each half of any picture, and `hand.onnx` a hand
in any picture, a right one if it is bright.
"""

import sys
from pathlib import Path

import numpy
import onnx
from onnx import TensorProto, helper, numpy_helper

JOINTS = 17
SIZE = (256, 192)


def colours() -> numpy.ndarray:
    """A colour of each joint, 0 to 1."""
    steps = [(joint % 3, joint // 3 % 3, 2 * (joint // 9)) for joint in range(JOINTS)]
    return (0.2 + 0.3 * numpy.array(steps)).astype(numpy.float32)


def made(name: str, nodes, inputs, outputs, weights, opset=13):
    values = lambda each: [helper.make_tensor_value_info(n, TensorProto.FLOAT, shape) for n, shape in each.items()]
    of = lambda value: numpy.asarray(value, numpy.int64 if isinstance(value, tuple) else numpy.float32)
    weights = [numpy_helper.from_array(of(value), n) for n, value in weights.items()]
    graph = helper.make_graph(nodes, name, values(inputs), values(outputs), weights)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", opset)], ir_version=8)
    onnx.checker.check_model(model)
    return model


def saved(name: str, *parts) -> None:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    onnx.save(made(name, *parts), folder / f"{name}.onnx")


def joints() -> tuple:
    """1 - 8 |colour - joint's|, not below 0, averaged over 5 x 5 pixels."""
    width, height = SIZE
    # Of each joint and part of a colour how far it is above, and how far below: together the distance.
    apart = numpy.zeros((6 * JOINTS, 3, 1, 1))
    shift = numpy.zeros(6 * JOINTS)
    near = numpy.zeros((JOINTS, 6 * JOINTS, 1, 1))
    for joint, colour in enumerate(colours()):
        for part in range(3):
            for place, sign in ((6 * joint + part, 1), (6 * joint + 3 + part, -1)):
                apart[place, part] = sign
                shift[place] = -sign * colour[part]
                near[joint, place] = -8
    nodes = [
        helper.make_node("Conv", ["picture", "apart", "shift"], ["signed"], kernel_shape=[1, 1]),
        helper.make_node("Relu", ["signed"], ["distance"]),
        helper.make_node("Conv", ["distance", "near", "ones"], ["likeness"], kernel_shape=[1, 1]),
        helper.make_node("Relu", ["likeness"], ["likely"]),
        helper.make_node("AveragePool", ["likely"], ["maps"], kernel_shape=[5, 5], strides=[1, 1], pads=[2] * 4),
    ]
    weights = {"apart": apart, "shift": shift, "near": near, "ones": numpy.ones(JOINTS)}
    return "joints", nodes, {"picture": [1, 3, height, width]}, {"maps": [1, JOINTS, height, width]}, weights


def joints_between(top: int, bottom: int):
    """The same, but it looks at these rows of the picture only, which takes less time."""
    name, (apart, *middle, last), inputs, outputs, weights = joints()
    rows = helper.make_node("Slice", ["picture", "top", "bottom", "axis"], ["rows"])
    apart.input[0], last.output[0] = "rows", "found"
    whole = helper.make_node("Pad", ["found", "around"], ["maps"])
    around = (0, 0, top, 0, 0, 0, SIZE[1] - bottom, 0)
    weights |= {"top": (top,), "bottom": (bottom,), "axis": (2,), "around": around}
    return made(name, [rows, apart, *middle, last, whole], inputs, outputs, weights)


def net() -> None:
    random = numpy.random.default_rng(1)
    normal = lambda *shape: 0.3 * random.standard_normal(shape)
    nodes = [
        helper.make_node("Conv", ["picture", "a", "ab"], ["a1"], kernel_shape=[3, 3], strides=[2, 2], pads=[1] * 4),
        helper.make_node("Clip", ["a1", "low", "high"], ["a2"]),
        helper.make_node("Conv", ["a2", "b", "bb"], ["b1"], kernel_shape=[3, 3], pads=[1] * 4, group=8),
        helper.make_node("Sigmoid", ["b1"], ["b2"]),
        helper.make_node("Mul", ["b1", "b2"], ["b3"]),
        helper.make_node("Add", ["a2", "b3"], ["b4"]),
        helper.make_node("Conv", ["b4", "c", "cb"], ["c1"], kernel_shape=[1, 1]),
        helper.make_node("BatchNormalization", ["c1", "gain", "bias", "mean", "var"], ["c2"]),
        helper.make_node("MaxPool", ["c2"], ["c3"], kernel_shape=[2, 2], strides=[2, 2]),
        helper.make_node("GlobalAveragePool", ["c3"], ["d1"]),
        helper.make_node("Flatten", ["d1"], ["d2"]),
        helper.make_node("Gemm", ["d2", "e", "eb"], ["scores"], transB=1),
    ]
    weights = {
        "a": normal(8, 3, 3, 3), "ab": normal(8), "low": 0, "high": 6, "b": normal(8, 1, 3, 3), "bb": normal(8),
        "c": normal(16, 8, 1, 1), "cb": normal(16), "gain": normal(16), "bias": normal(16), "mean": normal(16),
        "var": numpy.abs(normal(16)) + 0.5, "e": normal(7, 16), "eb": normal(7),
    }  # fmt: skip
    saved("net", nodes, {"picture": [1, 3, 32, 32]}, {"scores": [1, 7]}, weights)


def hands() -> None:
    """Numbers that are the same for every picture, but for which hand it is: the mean brightness."""
    palm = [[0, 3], [-2, -2], [0, -3], [1.5, -2.5], [3, -1], [-2, 2], [-3, 0]]
    row = numpy.concatenate([[0, 0, 6, 6], numpy.ravel(palm)])
    mean = helper.make_node("ReduceMean", ["picture"], ["mean"], keepdims=0)
    nothing = helper.make_node("Mul", ["mean", "zero"], ["nothing"])
    same = lambda name: helper.make_node("Add", [f"{name}_is", "nothing"], [name])
    weights = {"zero": 0, "offsets_is": [[row, row]], "scores_is": [[[4], [3]]]}
    outputs = {"offsets": [1, 2, 18], "scores": [1, 2, 1]}
    saved("palms", [mean, nothing, same("offsets"), same("scores")], {"picture": [1, 16, 32, 3]}, outputs, weights)
    right = helper.make_node("Mul", ["ones", "mean"], ["handedness"])
    weights = {"zero": 0, "points_is": [[0, 0, 5, 7, 7, 5]], "presence_is": [[0.9]], "ones": [[1]]}
    outputs = {"points": [1, 6], "presence": [1, 1], "handedness": [1, 1]}
    saved("hand", [mean, nothing, same("points"), same("presence"), right], {"picture": [1, 8, 8, 3]}, outputs, weights)


if __name__ == "__main__":
    saved(*joints())
    net()
    hands()
