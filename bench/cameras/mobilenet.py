"""A model as large as MobileNetV2 (Sandler et al. 2018, doi:10.1109/CVPR.2018.00474), with random weights: it costs as
much as such a model, but computes nothing useful."""

import numpy
import onnx
from onnx import TensorProto, helper, numpy_helper

SIDE, CLASSES = 224, 8
# Expansion, channels, repeats and the first stride of each group of blocks (table 2 there).
GROUPS = [(1, 16, 1, 1), (6, 24, 2, 2), (6, 32, 3, 2), (6, 64, 4, 2), (6, 96, 3, 1), (6, 160, 3, 2), (6, 320, 1, 1)]


class Network:
    """A model's layers, in the order in which they are added."""

    def __init__(self, seed: int):
        self.random = numpy.random.default_rng(seed)
        self.nodes, self.weights, self.last, self.channels = [], [], "picture", 3

    def convolution(self, channels: int, side=1, stride=1, groups=1, is_linear=False) -> None:
        count = len(self.weights)
        shape = (channels, self.channels // groups, side, side)
        weights = self.random.normal(0, (2 / numpy.prod(shape[1:])) ** 0.5, shape).astype(numpy.float32)
        self.weights += [numpy_helper.from_array(weights, f"w{count}"), numpy_helper.from_array(numpy.zeros(channels, numpy.float32), f"b{count}")]
        options = {"kernel_shape": [side] * 2, "strides": [stride] * 2, "pads": [side // 2] * 4, "group": groups}
        self.add("Conv", [f"w{count}", f"b{count}"], **options)
        self.channels = channels
        if not is_linear:
            self.add("Clip", ["low", "high"])

    def add(self, kind: str, more=(), **options) -> None:
        name = f"t{len(self.nodes)}"
        self.nodes.append(helper.make_node(kind, [self.last, *more], [name], **options))
        self.last = name

    def block(self, expansion: int, channels: int, stride: int) -> None:
        before, same = self.last, stride == 1 and channels == self.channels
        inner = self.channels * expansion
        if expansion > 1:
            self.convolution(inner)
        self.convolution(inner, side=3, stride=stride, groups=inner)
        self.convolution(channels, is_linear=True)
        if same:
            self.add("Add", [before])


def model(seed: int = 1) -> bytes:
    """Returns the model as an ONNX file."""
    network = Network(seed)
    network.convolution(32, side=3, stride=2)
    for expansion, channels, repeats, stride in GROUPS:
        for repeat in range(repeats):
            network.block(expansion, channels, stride if repeat == 0 else 1)
    network.convolution(1280)
    network.add("GlobalAveragePool")
    network.convolution(CLASSES, is_linear=True)
    network.add("Flatten")
    bounds = [numpy_helper.from_array(numpy.float32(level), name) for name, level in (("low", 0), ("high", 6))]
    of = lambda name, shape: helper.make_tensor_value_info(name, TensorProto.FLOAT, shape)
    inputs, outputs = [of("picture", [1, 3, SIDE, SIDE])], [of(network.last, [1, CLASSES])]
    graph = helper.make_graph(network.nodes, "mobilenet", inputs, outputs, network.weights + bounds)
    made = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)], ir_version=8)
    onnx.checker.check_model(made)
    return made.SerializeToString()
