"""ONNX graphs, short to write: names in a row, and matrices that are stored as float16."""

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import onnx
from onnx import NodeProto, TensorProto, ValueInfoProto, helper, numpy_helper

__all__ = ["graph_model", "node", "value"]

OPSET = 17
IR_VERSION = 8
"""Old enough for every onnxruntime this project supports."""


def node(op: str, inputs: str, outputs: str, **attributes: Any) -> NodeProto:
    """An operation; its inputs and outputs by their names with blanks between."""
    return helper.make_node(op, inputs.split(), outputs.split(), **attributes)


def value(name: str, *shape: str | int) -> ValueInfoProto:
    """An input or output of the graph, float32."""
    return helper.make_tensor_value_info(name, TensorProto.FLOAT, shape)


def graph_model(
    name: str,
    nodes: Sequence[NodeProto],
    inputs: Sequence[ValueInfoProto],
    outputs: Sequence[ValueInfoProto],
    weights: Mapping[str, npt.NDArray[np.float32]],
    halved: Collection[str],
    constants: Mapping[str, npt.NDArray[Any]],
) -> onnx.ModelProto:
    """A checked model.

    Args:
        name: of the graph.
        nodes: in an order in which they can be run.
        inputs: of the graph.
        outputs: of the graph.
        weights: float32, by the names that the nodes use.
        halved: which of them are stored as float16; the engine casts them when it loads.
        constants: other arrays that the nodes use.
    """
    arrays: dict[str, npt.NDArray[Any]] = {k: w for k, w in weights.items() if k not in halved}
    arrays |= {k + "_16": weights[k].astype(np.float16) for k in halved}
    arrays |= constants
    casts = [helper.make_node("Cast", [k + "_16"], [k], to=TensorProto.FLOAT) for k in halved]
    stored = [numpy_helper.from_array(array, k) for k, array in arrays.items()]
    graph = helper.make_graph([*casts, *nodes], name, inputs, outputs, stored)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)])
    model.ir_version = IR_VERSION
    onnx.checker.check_model(model)
    return model
