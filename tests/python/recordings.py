#!/usr/bin/env python3
"""Reads and writes recordings with independent packages: rosbags, mcap, mcap-ros1-support.

usage: recordings.py read FILE            one line of JSON per message: topic, type, time, every number of it in its order
       recordings.py recover FILE         the same of an MCAP file without an end, by the reader that needs no index
       recordings.py write FILE HOW N     N states (see state()) as /ravenstate; HOW: none, bz2, lz4 for a bag, none, zstd,
                                          lz4, unchunked for an MCAP file; the definition comes from standard input

Whole numbers stand as such, fractions as the hexadecimal digits of their bits, so that nothing is lost on the way.
"""
import json
import struct
import sys

NAME = "raven_2/raven_state"
SCALARS = ("seq", "secs", "nsecs", "sec", "nanosec")


def digits(value, fmt):
    return struct.pack(">" + fmt, value).hex()


def numbers(value, kind):
    """Every number of a decoded message in its order; kind is the ROS type of the field."""
    element = kind.split("[")[0]
    if element in ("time", "duration"):
        secs = value.secs if hasattr(value, "secs") else value.sec
        nsecs = value.nsecs if hasattr(value, "nsecs") else value.nanosec
        return [int(secs), int(nsecs)]
    if element in ("float32", "float64"):
        values = value if "[" in kind else [value]
        if hasattr(values, "view"):
            size = values.dtype.itemsize
            return [format(int(bits), "0%dx" % (2 * size)) for bits in values.view("u%d" % size)]
        return [digits(float(one), "f" if element == "float32" else "d") for one in values]
    if element == "string":
        return list(value) if "[" in kind else [value]
    if "[" in kind:
        return [int(one) for one in value]
    return [int(value)]


def flat(message, definition):
    """Walks a message along its definition text: lines of the main type, types of others by their own section."""
    sections = definition.split("=" * 80 + "\n")
    lines = {"": sections[0].splitlines()}
    for section in sections[1:]:
        name, *rest = section.splitlines()
        lines[name.removeprefix("MSG: ")] = rest

    def walk(value, own):
        out = []
        for line in own:
            line = line.split("#")[0].split()
            if len(line) != 2:
                continue
            kind, name = line
            inner = lines.get("std_msgs/Header" if kind == "Header" else kind)
            field = getattr(value, name)
            out += walk(field, inner) if inner is not None else numbers(field, kind)
        return out

    return walk(message, lines[""])


def show(topic, kind, time_ns, message, definition):
    print(json.dumps([topic, kind, int(time_ns), flat(message, definition)]))


def read_bag(path):
    from rosbags.rosbag1 import Reader
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    with Reader(path) as reader:
        store = get_typestore(Stores.ROS1_NOETIC)
        for connection in reader.connections:
            store.register(get_types_from_msg(connection.msgdef.data, connection.msgtype))
            assert store.generate_msgdef(connection.msgtype)[1] == connection.digest, connection.topic
        for connection, time_ns, raw in reader.messages():
            message = store.deserialize_ros1(raw, connection.msgtype)
            show(connection.topic, connection.msgtype.replace("/msg/", "/"), time_ns, message, connection.msgdef.data)


def read_mcap(path):
    from mcap.reader import make_reader
    from mcap_ros1.decoder import DecoderFactory

    with open(path, "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == "ros1"
        for metadata in reader.iter_metadata():
            for key, value in metadata.metadata.items():
                print(json.dumps([metadata.name, key, value]))
        for schema, channel, message, decoded in reader.iter_decoded_messages(log_time_order=False):
            show(channel.topic, schema.name, message.log_time, decoded, schema.data.decode())


def recover_mcap(path):
    from mcap.exceptions import McapError
    from mcap.reader import NonSeekingReader
    from mcap_ros1.decoder import DecoderFactory

    with open(path, "rb") as file:
        reader = NonSeekingReader(file, decoder_factories=[DecoderFactory()])
        try:
            for schema, channel, message, decoded in reader.iter_decoded_messages(log_time_order=False):
                show(channel.topic, schema.name, message.log_time, decoded, schema.data.decode())
        except McapError:
            pass


def state(index):
    """Values that the Rust side computes as well."""
    ints = lambda count, step: b"".join(struct.pack("<i", index * 1000 + step * 100 + i) for i in range(count))
    floats = lambda count, step: b"".join(struct.pack("<f", index + step / 4 + i / 64) for i in range(count))
    return (
        struct.pack("<IIII", index, 1700000000 + index, 500, 0)
        + ints(3, 1) + ints(2, 2) + ints(6, 3) + floats(18, 4) + floats(18, 5) + ints(6, 6) + ints(2, 7)
        + ints(16, 8) + ints(16, 9) + b"".join(floats(16, step) for step in range(10, 17))
        + floats(2, 17) + floats(16, 18) + floats(12, 19) + floats(12, 20)
    )


def write_bag(path, how, count, definition):
    from rosbags.rosbag1 import Writer

    writer = Writer(path)
    if how != "none":
        writer.set_compression({"bz2": Writer.CompressionFormat.BZ2, "lz4": Writer.CompressionFormat.LZ4}[how])
    with writer:
        topic = writer.add_connection("/ravenstate", "raven_2/msg/raven_state", msgdef=definition, md5sum="ce9e7f4969049d8bb365de3c98461a01")
        for index in range(count):
            writer.write(topic, (1700000000 + index) * 1000000000 + 500, state(index))


def write_mcap(path, how, count, definition):
    from mcap.writer import CompressionType, Writer

    compression = {"zstd": CompressionType.ZSTD, "lz4": CompressionType.LZ4}.get(how, CompressionType.NONE)
    writer = Writer(path, compression=compression, use_chunking=how != "unchunked", enable_data_crcs=True)
    writer.start(profile="ros1", library="recordings.py")
    schema = writer.register_schema(NAME, "ros1msg", definition.encode())
    channel = writer.register_channel("/ravenstate_100hz", "ros1", schema)
    for index in range(count):
        time_ns = (1700000000 + index) * 1000000000 + 500
        writer.add_message(channel, time_ns, state(index), time_ns, index)
    writer.finish()


def main():
    command, path = sys.argv[1:3]
    is_bag = path.endswith(".bag")
    if command == "read":
        (read_bag if is_bag else read_mcap)(path)
    elif command == "recover":
        recover_mcap(path)
    else:
        (write_bag if is_bag else write_mcap)(path, sys.argv[3], int(sys.argv[4]), sys.stdin.read())


main()
