#!/usr/bin/env python3
"""Writes models/untrained.onnx: the final format with random weights, marked untrained.

The network is the paper's (118-600-500-400-3, sigmoid, batch norm) with normalisation inside the graph and all metadata that
docs/models.md describes, so that the service, its guards and the demo run on the real format before a trained model exists. Its
corrections mean nothing. Repeat with: python3 models/make_untrained.py (needs numpy and onnx; the seed is fixed).
"""
import hashlib
import pathlib

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

WIDTHS = [118, 600, 500, 400, 3]
# (start, count, low, high): a generous working range of each feature, units as published (docs/messages.md)
RANGES = [
    (0, 6, -300_000, 300_000), (6, 18, -1.0005, 1.0005), (24, 8, -2_000_000, 2_000_000), (32, 8, -5000, 5000), (40, 8, -10, 10),
    (48, 8, -150_000, 150_000), (56, 1, -5, 95), (57, 1, 40, 140), (58, 1, 11.5, 33), (59, 1, -1, 1), (60, 1, -200, 200),
    (61, 1, -90, 90), (62, 2, -120, 120), (64, 8, -50_000, 50_000), (72, 2, -500, 500), (74, 1, -30, 30), (75, 5, -1, 1),
    (80, 8, -150_000, 150_000), (88, 1, -5, 95), (89, 1, 40, 140), (90, 1, 11.5, 33), (91, 1, -1, 1), (92, 1, -200, 200),
    (93, 1, -90, 90), (94, 2, -120, 120), (96, 1, -4, 4), (97, 8, -2_000_000, 2_000_000), (105, 12, -50_000, 50_000),
    (117, 1, 0, 0.05),
]


def main():
    rng = np.random.default_rng(20261121)
    low = np.empty(118, np.float32)
    high = np.empty(118, np.float32)
    for start, count, a, b in RANGES:
        low[start:start + count], high[start:start + count] = a, b
    mean = ((low.astype(np.float64) + high) / 2).astype(np.float32)
    std = ((high.astype(np.float64) - low) / 8).astype(np.float32)

    nodes, weights = [], []

    def constant(name, value):
        weights.append(numpy_helper.from_array(np.asarray(value, np.float32), name))
        return name

    nodes.append(helper.make_node("Sub", ["ravenstate", constant("mean", mean)], ["centred"]))
    nodes.append(helper.make_node("Div", ["centred", constant("std", std)], ["scaled"]))
    current = "scaled"
    x = rng.normal(size=(4096, 118))
    for layer, (inputs, outputs) in enumerate(zip(WIDTHS[:-1], WIDTHS[1:])):
        w = rng.laplace(scale=np.sqrt(1.0 / (inputs + outputs)), size=(outputs, inputs)).astype(np.float32)
        b = rng.normal(scale=0.05, size=outputs).astype(np.float32)
        last = layer == len(WIDTHS) - 2
        if last:
            y = x @ w.T + b
            # Half a millimetre of standard deviation, so that a demo shows something that is plainly not a correction.
            w = (w * 0.5 / y.std(axis=0)[:, None]).astype(np.float32)
            b = (-(x @ w.T).mean(axis=0)).astype(np.float32)
        name = f"layer{layer}"
        out = "position_error" if last else f"{name}.sum"
        nodes.append(helper.make_node("Gemm", [current, constant(f"{name}.weight", w), constant(f"{name}.bias", b)], [out], transB=1))
        if last:
            break
        y = x @ w.T + b
        bn_mean, bn_var = y.mean(axis=0).astype(np.float32), y.var(axis=0).astype(np.float32)
        names = [constant(f"{name}.bn.{key}", value) for key, value in
                 [("scale", np.ones(outputs)), ("shift", np.zeros(outputs)), ("mean", bn_mean), ("var", bn_var)]]
        nodes.append(helper.make_node("BatchNormalization", [out, *names], [f"{name}.norm"], epsilon=1e-3))
        nodes.append(helper.make_node("Sigmoid", [f"{name}.norm"], [f"{name}.out"]))
        current = f"{name}.out"
        x = 1 / (1 + np.exp(-(y - bn_mean) / np.sqrt(bn_var + 1e-3)))

    graph = helper.make_graph(
        nodes, "untrained",
        [helper.make_tensor_value_info("ravenstate", TensorProto.FLOAT, [1, 118])],
        [helper.make_tensor_value_info("position_error", TensorProto.FLOAT, [1, 3])], weights)
    model = helper.make_model(graph, producer_name="ravenpose make_untrained.py", opset_imports=[helper.make_opsetid("", 17)])
    model.ir_version = 8

    arrays = {w.name: numpy_helper.to_array(w).astype(np.float64) for w in weights}

    def evaluate(row):
        v = (row.astype(np.float64) - arrays["mean"]) / arrays["std"]
        for layer in range(len(WIDTHS) - 1):
            v = arrays[f"layer{layer}.weight"] @ v + arrays[f"layer{layer}.bias"]
            if layer < len(WIDTHS) - 2:
                v = (v - arrays[f"layer{layer}.bn.mean"]) / np.sqrt(arrays[f"layer{layer}.bn.var"] + 1e-3)
                v = 1 / (1 + np.exp(-v))
        return v

    golden = []
    for row in [mean, *(mean + std * rng.uniform(-2, 2, size=(7, 118)))]:
        row = row.astype(np.float32)
        golden.append(" ".join(f"{v:.9g}" for v in [*row, *evaluate(row)]))
    text = lambda values: " ".join(f"{v:.9g}" for v in values)
    half = (high.astype(np.float64) - low) / 2
    for key, value in {
        "ravenpose.feature_layout": "raven118-v1",
        "ravenpose.units": "raven_state as published; position error in mm",
        "ravenpose.trained_on": "nothing: random weights, seed 20261121",
        "ravenpose.feature_min": text(low),
        "ravenpose.feature_max": text(high),
        "ravenpose.domain_center": text(mean),
        "ravenpose.domain_weight": text(1 / half / np.sqrt(118)),
        "ravenpose.domain_limit": "1",
        "ravenpose.correction_bound_mm": "15",
        "ravenpose.golden": "\n".join(golden),
    }.items():
        entry = model.metadata_props.add()
        entry.key, entry.value = key, value
    onnx.checker.check_model(model, full_check=True)
    path = pathlib.Path(__file__).with_name("untrained.onnx")
    data = model.SerializeToString(deterministic=True)
    path.write_bytes(data)
    path.with_name("untrained.onnx.sha256").write_text(f"{hashlib.sha256(data).hexdigest()}  untrained.onnx\n")


if __name__ == "__main__":
    main()
