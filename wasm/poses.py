"""The last pose of every built-in scenario, as wasm/src/lib.rs prints it: python wasm/poses.py SECONDS."""

import struct
import sys

import omnistep

POSE = ["pose_x_m", "pose_y_m", "pose_z_m", "pose_qx", "pose_qy", "pose_qz", "pose_qw"]
for name in omnistep.scenarios():
    trace = omnistep.run(name, overrides={"duration_s": float(sys.argv[1])}, progress=False)
    print(name, len(trace["time_s"]), *(struct.pack(">d", trace[column][-1]).hex() for column in POSE))
