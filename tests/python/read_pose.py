#!/usr/bin/env python3
"""Reads raven/pose with the official iceoryx2 package: an independent client.

usage: read_pose.py COUNT [PREFIX ROOT [exact]]
Prints one line of JSON per pose, every field by its documented name (docs/messages.md has the layout); with `exact`, fractions as
the hexadecimal digits of their double, so that nothing is lost on the way.
"""
import ctypes
import json
import math
import struct
import sys
import time

import iceoryx2 as iox2


EXACT = sys.argv[4:] == ["exact"]


class ArmPose(ctypes.Structure):
    _fields_ = [
        ("status", ctypes.c_uint32),
        ("flags", ctypes.c_uint32),
        ("model_id", ctypes.c_uint64),
        ("reset_count", ctypes.c_uint32),
        ("domain_score", ctypes.c_float),
        ("raw_position_um", ctypes.c_double * 3),
        ("correction_um", ctypes.c_double * 3),
        ("corrected_position_um", ctypes.c_double * 3),
        ("bound95_um", ctypes.c_double * 3),
        ("orientation", ctypes.c_float * 9),
        ("hold_cycles", ctypes.c_uint32),
        ("orientation_model_id", ctypes.c_uint64),
        ("rotation_deg", ctypes.c_double * 3),
        ("rotation_bound95_deg", ctypes.c_double * 3),
        ("corrected_orientation", ctypes.c_float * 9),
        ("reserved", ctypes.c_uint32),
    ]


class CorrectedPose(ctypes.Structure):
    _fields_ = [
        ("version", ctypes.c_uint32),
        ("size", ctypes.c_uint32),
        ("guard_head", ctypes.c_uint64),
        ("sequence", ctypes.c_uint64),
        ("source_id", ctypes.c_uint64),
        ("source_sequence", ctypes.c_uint64),
        ("source_time_ns", ctypes.c_int64),
        ("start_time_ns", ctypes.c_int64),
        ("publish_time_ns", ctypes.c_int64),
        ("arms", ctypes.c_uint32),
        ("runlevel", ctypes.c_int32),
        ("cycles", ctypes.c_uint64),
        ("lost", ctypes.c_uint64),
        ("skipped", ctypes.c_uint64),
        ("duplicates", ctypes.c_uint64),
        ("out_of_order", ctypes.c_uint64),
        ("refused", ctypes.c_uint64),
        ("late", ctypes.c_uint64),
        ("overruns", ctypes.c_uint64),
        ("arm", ArmPose * 2),
        ("guard_tail", ctypes.c_uint64),
    ]

    @staticmethod
    def type_name() -> str:
        return "CorrectedPose.v1"


def plain(value):
    if isinstance(value, ctypes.Structure):
        return {name: plain(getattr(value, name)) for name, *_ in value._fields_}
    if isinstance(value, ctypes.Array):
        return [plain(item) for item in value]
    if isinstance(value, float) and math.isnan(value):
        return None
    if isinstance(value, float) and EXACT:
        return struct.pack(">d", value).hex()
    return value


def main():
    count = int(sys.argv[1])
    iox2.set_log_level(iox2.LogLevel.Error)
    config = iox2.config.default()
    if len(sys.argv) > 3:
        config.global_cfg.prefix = iox2.FileName.new(sys.argv[2])
        config.global_cfg.root_path = iox2.Path.new(sys.argv[3])
    node = iox2.NodeBuilder.new().config(config).signal_handling_mode(iox2.SignalHandlingMode.Disabled).create(iox2.ServiceType.Ipc)
    service = node.service_builder(iox2.ServiceName.new("raven/pose")).publish_subscribe(CorrectedPose).open()
    subscriber = service.subscriber_builder().create()
    print("connected", flush=True)
    deadline = time.monotonic() + 90
    while count > 0 and time.monotonic() < deadline:
        sample = subscriber.receive()
        if sample is None:
            time.sleep(0.0001)
            continue
        print(json.dumps(plain(sample.payload().contents)), flush=True)
        count -= 1
    return 0 if count == 0 else 1


if __name__ == "__main__":
    sys.exit(main())
