#!/usr/bin/env python3
"""Logs as other programs write them, and their signals as numpy sees them, for host/convert/tests/foreign.rs.

    python3 tests/foreign/logs.py     (numpy, scipy, h5py, mcap, mcap-ros2-support; tests/foreign/requirements.txt)

writes tests/foreign/logs/: files of scipy.io.savemat (level 5), of h5py in MATLAB's v7.3 layout, of the MCAP
and ROS 2 packages, and JSON in the layout of BAM's logs (github.com/Rhoban/bam, bam/dynamixel/record.py).
Beside each NAME.EXT stands NAME.csv, written from the arrays and never from the file.
"""

import json
from pathlib import Path

import h5py
import numpy as np
import scipy.io
from mcap.writer import CompressionType
from mcap.writer import Writer as PlainWriter
from mcap_ros2.writer import Writer

FOLDER = Path(__file__).resolve().parent / "logs"
ROWS = 24
T = np.arange(ROWS) * 0.02
Q = 0.3 * np.sin(5.0 * T)
QD = 1.5 * np.cos(5.0 * T)
U = np.where(np.arange(ROWS) // 6 % 2 == 0, 2, -2)


def expect(name, t, columns):
    """CSV with the shortest text of each double; an empty field is a missing sample."""
    lines = [",".join(["t", *columns])]
    text = lambda value: "" if np.isnan(value) else repr(float(value))
    for row in range(len(t)):
        lines.append(",".join([text(t[row]), *(text(values[row]) for values in columns.values())]))
    (FOLDER / f"{name}.csv").write_text("\n".join(lines) + "\n")


def level5():
    flat = {"t": T, "q_rad": Q, "u_V": U.astype(np.int16), "note": "by hand", "gain": 3.0}
    columns = {"q_rad": Q, "u_V": U}
    for name, options in {
        "row": {"oned_as": "row"},
        "column": {"oned_as": "column"},
        "packed": {"oned_as": "column", "do_compression": True},
    }.items():
        scipy.io.savemat(FOLDER / f"{name}.mat", flat, **options)
        expect(name, T, columns)
    # Every type of number; a matrix of two joints; single precision keeps its own rounding.
    types = {
        "double": np.float64, "single": np.float32, "int8": np.int8, "uint8": np.uint8, "int16": np.int16,
        "uint16": np.uint16, "int32": np.int32, "uint32": np.uint32, "int64": np.int64, "uint64": np.uint64,
    }
    numbers = {f"x_{name}": (np.arange(ROWS) * 5 % 120).astype(kind) for name, kind in types.items()}
    numbers["x_single"] = (0.1 * np.arange(ROWS)).astype(np.float32)
    numbers["x_int8"] = (numbers["x_int8"] - 60).astype(np.int8)
    both = np.stack([Q, QD], axis=1)
    scipy.io.savemat(FOLDER / "types.mat", {"time_ms": T * 1000.0, **numbers, "q_rad": both}, do_compression=True)
    expect("types", T * 1000.0 * 1e-3, {**{k: v.astype(float) for k, v in numbers.items()}, "q1_rad": Q, "q2_rad": QD})
    # A structure of signals, as a script of one's own keeps them.
    log = {"log": {"motor": {"t": T, "angle_rad": Q, "speed_rad_s": QD}, "mass_kg": 0.4}}
    scipy.io.savemat(FOLDER / "struct.mat", log, oned_as="column")
    expect("struct", T, {"angle_rad": Q, "speed_rad_s": QD})
    # Simulink's "structure with time": time, and signals with values and labels.
    signal = lambda values, label: {"values": values, "label": label, "dimensions": 1.0}
    signals = np.empty((1, 2), dtype=object)
    signals[0, 0] = signal(Q.reshape(-1, 1), "angle_rad")
    signals[0, 1] = signal(U.astype(float).reshape(-1, 1), "u_V")
    dtype = [("values", object), ("label", object), ("dimensions", object)]
    array = np.empty((1, 2), dtype=dtype)
    for place in range(2):
        array[0, place] = tuple(signals[0, place][key] for key, _ in dtype)
    scipy.io.savemat(FOLDER / "simulink.mat", {"out": {"time": T, "signals": array}}, oned_as="column")
    expect("simulink", T, {"angle_rad": Q, "u_V": U})
    # Two elements as timeseries have them, each with times of its own.
    slow = T[::4] + 0.003
    series = lambda t, x, unit: {"Time": t, "Data": x, "DataInfo": {"Units": unit}, "TimeInfo": {"Units": "seconds"}}
    logsout = {"logsout": {"angle": series(T, Q, "rad"), "command": series(slow, U[::4].astype(float), "V")}}
    scipy.io.savemat(FOLDER / "logsout.mat", logsout, oned_as="column")
    last = np.array([held(slow, U[::4], at) for at in T])
    expect("logsout", T, {"angle_rad": Q, "command_V": last})
    straight = np.interp(T, slow, U[::4], left=np.nan, right=np.nan)
    expect("logsout.linear", T, {"angle_rad": Q, "command_V": straight})


def held(t, values, at):
    """The last value before or at a time; none before the first, and none a step after the last."""
    if at < t[0] or at > t[-1] + np.median(np.diff(t)):
        return np.nan
    return float(values[np.searchsorted(t, at, side="right") - 1])


def level73():
    def put(group, name, values):
        # MATLAB reads dimensions backwards: an N x k matrix is a k x N dataset.
        values = np.asarray(values)
        flat = values.reshape(-1, 1) if values.ndim == 1 else values
        data = group.create_dataset(name, data=flat.T, chunks=True, compression="gzip")
        kind = {"f8": "double", "f4": "single", "i2": "int16"}[values.dtype.str[1:]]
        data.attrs["MATLAB_class"] = np.bytes_(kind)

    with h5py.File(FOLDER / "v73.mat", "w", userblock_size=512) as file:
        motor = file.create_group("log/motor")
        file["log"].attrs["MATLAB_class"] = np.bytes_("struct")
        motor.attrs["MATLAB_class"] = np.bytes_("struct")
        put(motor, "t", T)
        put(motor, "q_rad", np.stack([Q, QD], axis=1))
        put(motor, "u_V", U.astype(np.int16))
        label = motor.create_dataset("note", data=np.array([[ord(c)] for c in "two joints"], dtype=np.uint16))
        label.attrs["MATLAB_class"] = np.bytes_("char")
    header = b"MATLAB 7.3 MAT-file, written by tests/foreign/logs.py".ljust(116) + bytes(8) + b"\x00\x02IM"
    with open(FOLDER / "v73.mat", "r+b") as file:
        file.write(header)
    expect("v73", T, {"q1_rad": Q, "q2_rad": QD, "u_V": U})
    with h5py.File(FOLDER / "plain.h5", "w") as file:
        file["time"] = T
        file["time"].attrs["units"] = "s"
        file["q"] = np.stack([Q, QD], axis=1)
        file["q"].attrs["units"] = "rad"
    expect("plain", T, {"q1_rad": Q, "q2_rad": QD})


JOINT_STATE = """std_msgs/Header header
string[] name
float64[] position
float64[] velocity
float64[] effort
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
ORIGIN_NS = 1_700_000_000_123_456_789


def ros():
    elbow = 0.5 - Q
    # No velocity at first, as drivers do that still differentiate; the joints change places.
    for name, compression in {"ros": CompressionType.NONE, "ros_zstd": CompressionType.ZSTD, "ros_lz4": CompressionType.LZ4}.items():
        with open(FOLDER / f"{name}.mcap", "wb") as stream:
            writer = Writer(stream, chunk_size=700, compression=compression)
            state = writer.register_msgdef("sensor_msgs/msg/JointState", JOINT_STATE)
            number = writer.register_msgdef("std_msgs/msg/Float64", "float64 data\n")
            for row in range(ROWS):
                ns = ORIGIN_NS + row * 20_000_000
                order = [0, 1] if row % 2 == 0 else [1, 0]
                pick = lambda pair: [float(pair[k]) for k in order]
                message = {
                    "header": {"stamp": {"sec": ns // 10**9, "nanosec": ns % 10**9}, "frame_id": "base" + "x" * (row % 5)},
                    "name": [["shoulder", "elbow"][k] for k in order],
                    "position": pick([Q[row], elbow[row]]),
                    "velocity": pick([QD[row], -QD[row]]) if row > 2 else [],
                    "effort": [],
                }
                writer.write_message("/joint_states", state, message, log_time=ns + 1_000_000, publish_time=ns)
                if row % 5 == 1:
                    writer.write_message("/shoulder/command", number, {"data": float(U[row])}, log_time=ns + 7_000_000)
            writer.finish()
        t = np.array([(row * 20_000_000) / 1e9 for row in range(ROWS)])
        at = np.array([(row * 20_000_000 + 7_000_000) / 1e9 for row in range(ROWS) if row % 5 == 1])
        command = np.array([U[row] for row in range(ROWS) if row % 5 == 1], dtype=float)
        missing = lambda values: np.where(np.arange(ROWS) > 2, values, np.nan)
        expect(name, t, {
            "shoulder_rad": Q, "elbow_rad": elbow, "elbow_rad_s": missing(-QD), "shoulder_rad_s": missing(QD),
            "command": np.array([held(at, command, now) for now in t]),
        })
    # A topic of another type is listed and not read.
    with open(FOLDER / "image.mcap", "wb") as stream:
        writer = PlainWriter(stream)
        writer.start()
        schema = writer.register_schema("sensor_msgs/msg/Image", "ros2msg", b"")
        channel = writer.register_channel("/camera", "cdr", schema)
        writer.add_message(channel, log_time=1, publish_time=1, data=b"\x00\x01\x00\x00")
        writer.finish()


def bam():
    goal = 0.4 * np.sin(4.0 * T)
    entries = [
        {
            "position": float(Q[row]), "speed": float(QD[row]), "load": float(U[row]), "input_volts": 7.3,
            "temp": 31, "timestamp": float(T[row]), "goal_position": float(goal[row]), "torque_enable": bool(row < 20),
        }
        for row in range(ROWS)
    ]
    head = {"mass": 0.49, "arm-mass": 0.02, "length": 0.1, "kp": 200, "vin": 7.4, "motor": "xl330", "trajectory": "sin_sin"}
    (FOLDER / "bam.json").write_text(json.dumps({**head, "entries": entries}))
    on = np.arange(ROWS) < 20
    expect("bam", T, {
        "qgoal_rad": goal, "supply_V": np.full(ROWS, 7.3), "load": U, "q_rad": Q, "qd_rad_s": QD,
        "temp_degC": np.full(ROWS, 31), "torque_on": on,
    })


FOLDER.mkdir(exist_ok=True)
level5()
level73()
ros()
bam()
