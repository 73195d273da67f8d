"""The network as the published scripts run it: Keras `predict` with one row, beside the same model called, traced, and ONNX Runtime.

All from Python, one thread, in turns within each round, on the last core. `make bench-peers` calls it; --out keeps what it prints."""

import argparse
import os
import pathlib
import subprocess
import time

os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "3")
os.environ.setdefault("CUDA_VISIBLE_DEVICES", "")
import keras
import numpy
import onnx
import onnxruntime
import tensorflow

MODEL = pathlib.Path(__file__).parent.parent / "models/untrained.onnx"
ROUNDS = 3
INPUTS = 64


def keras_model():
    """The layers of the ONNX file, with its weights, as Keras has them."""
    graph = onnx.load(MODEL).graph
    values = {one.name: onnx.numpy_helper.to_array(one) for one in graph.initializer}
    inputs = keras.Input((118,))
    x = inputs
    for node in graph.node:
        constants = [values[name] for name in node.input if name in values]
        attributes = {a.name: onnx.helper.get_attribute_value(a) for a in node.attribute}
        if node.op_type == "Sub":
            mean = constants[0].ravel()
        elif node.op_type == "Div":
            x = keras.layers.Normalization(mean=mean, variance=constants[0].ravel() ** 2)(x)
        elif node.op_type == "Gemm":
            weights, bias = constants
            weights = weights.T if attributes.get("transB") else weights
            layer = keras.layers.Dense(weights.shape[1])
            x = layer(x)
            layer.set_weights([weights, bias])
        elif node.op_type == "BatchNormalization":
            layer = keras.layers.BatchNormalization(epsilon=attributes.get("epsilon", 1e-5))
            x = layer(x)
            layer.set_weights(constants)
        elif node.op_type == "Sigmoid":
            x = keras.layers.Activation("sigmoid")(x)
        else:
            raise SystemExit(f"{MODEL}: has {node.op_type}, which this script does not know")
    return keras.Model(inputs, x)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=pathlib.Path)
    options = parser.parse_args()
    if options.out:
        # What an earlier run left is not this one's.
        options.out.unlink(missing_ok=True)
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    tensorflow.config.threading.set_intra_op_parallelism_threads(1)
    tensorflow.config.threading.set_inter_op_parallelism_threads(1)

    limits = onnxruntime.SessionOptions()
    limits.intra_op_num_threads = limits.inter_op_num_threads = 1
    session = onnxruntime.InferenceSession(str(MODEL), limits, providers=["CPUExecutionProvider"])
    model = keras_model()
    traced = tensorflow.function(model, reduce_retracing=True)
    engines = {
        f"ONNX Runtime {onnxruntime.__version__}": (2000, lambda row: session.run(None, {"ravenstate": row})[0]),
        "tf.function": (500, lambda row: traced(row, training=False).numpy()),
        "Keras model called": (100, lambda row: model(row, training=False).numpy()),
        f"Keras {keras.__version__} predict (TensorFlow {tensorflow.__version__})": (40, lambda row: model.predict(row, verbose=0)),
    }
    # Within what the network was made for: a plain normal would saturate it.
    graph = {one.name: onnx.numpy_helper.to_array(one).ravel() for one in onnx.load(MODEL).graph.initializer}
    first = onnx.load(MODEL).graph.node[:2]
    shift, scale = (next(graph[name] for name in node.input if name in graph) for node in first)
    random = numpy.random.default_rng(1)
    rows = [(shift + scale * random.standard_normal((1, 118))).astype(numpy.float32) for _ in range(INPUTS)]

    wanted = [engines[name][1](rows[0]) for name in engines]
    spread = float(numpy.max([numpy.abs(one - wanted[0]).max() for one in wanted]))
    if not spread < 1e-3:
        raise SystemExit(f"the engines differ by {spread} mm on one input: not the same network")

    times = {name: [] for name in engines}
    for _ in range(ROUNDS):
        for name, (runs, run) in engines.items():
            for k in range(5 + runs):
                begun = time.perf_counter_ns()
                run(rows[k % INPUTS])
                if k >= 5:
                    times[name].append((time.perf_counter_ns() - begun) / 1e3)

    commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], stdout=subprocess.PIPE, text=True).stdout.strip() or "unknown"
    said = [f"{time.strftime('%Y-%m-%d %H:%M', time.gmtime())} UTC, commit {commit}", f"{'From Python, one row, one thread, us':58} {'p50':>9} {'p99':>9} {'max':>9} {'/ ORT':>9}"]
    peer = numpy.median(times[next(iter(engines))])
    for name, taken in times.items():
        said.append(f"  {name:56} {numpy.median(taken):9.1f} {numpy.quantile(taken, 0.99):9.1f} {max(taken):9.1f} {numpy.median(taken) / peer:9.2f}")
    print("\n".join(said))
    if options.out:
        options.out.parent.mkdir(parents=True, exist_ok=True)
        beside = options.out.with_suffix(".new")
        beside.write_text("\n".join(said) + "\n")
        beside.rename(options.out)


if __name__ == "__main__":
    main()
