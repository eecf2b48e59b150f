"""The last poses of built-in scenarios with every engine, as wasm/src/lib.rs prints them: poses.py SECONDS."""

import struct
import sys

import omnistep

POSE = ["pose_x_m", "pose_y_m", "pose_z_m", "pose_qx", "pose_qy", "pose_qz", "pose_qw"]
PHYSICS = [
    ("rapier", "ball", ""),
    ("articulated", "ball", "-articulated"),
    ("articulated", "rollers", "-articulated-rollers"),
]
for name in omnistep.list_scenarios():
    for engine, wheels, suffix in PHYSICS:
        keys = {"duration_s": float(sys.argv[1]), "physics.engine": engine, "physics.wheel_model": wheels}
        trace = omnistep.run(name, overrides=keys, progress=False)
        bits = (struct.pack(">d", trace[column][-1]).hex() for column in POSE)
        print(f"{name}{suffix}", len(trace["time_s"]), *bits)
