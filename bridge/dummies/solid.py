#!/usr/bin/python3
# SPDX-License-Identifier: MIT
"""A complete structural solver in Python: a rigid wall on a spring, by the trapezoidal rule. Prints
the last displacement. Usage: SLUICE_LIBRARY=.../libsluice.so solid.py CASE.toml --out DIR, or --check
"""
import ctypes
import os
import sys

MASS, STIFFNESS = 1.0, 4e4  # [kg/m], [N/m^2]


class Bridge:  # the functions of sluice.h; a failure ends the program with its message
    def __init__(self, role, case, folder, library):
        self.library = ctypes.CDLL(library)
        self.library.sluice_open.restype = ctypes.c_void_p
        self.library.sluice_message.restype = ctypes.c_char_p
        self.library.sluice_max_time_step_size.restype = ctypes.c_double
        message = ctypes.create_string_buffer(1000)
        self.handle = ctypes.c_void_p(self.library.sluice_open(
            role.encode(), case.encode(), folder.encode(), message, ctypes.c_size_t(1000)))
        if not self.handle:
            sys.exit("solid.py: " + message.value.decode())

    def ask(self, name):
        return getattr(self.library, "sluice_" + name)(self.handle)

    def call(self, name, *arguments):
        if getattr(self.library, "sluice_" + name)(self.handle, *arguments):
            sys.exit("solid.py: " + self.library.sluice_message(self.handle).decode())


def main(case, folder, library):
    vector, n = ctypes.c_double * 6, ctypes.c_size_t
    bridge = Bridge("solid", case, folder, library)
    bridge.call("set_mesh", 2, n(3), vector(0, 0, 0, 0.5, 0, 1), 2, n(2), (ctypes.c_int * 4)(0, 1, 1, 2))
    d, v, saved, force = 0.01, 0.0, None, vector()
    bridge.call("write_data", b"displacement", vector(d, 0, d, 0, d, 0), n(6))
    bridge.call("initialize")
    while bridge.ask("is_coupling_ongoing"):
        saved = (d, v) if bridge.ask("requires_writing_checkpoint") else saved
        dt = bridge.ask("max_time_step_size")
        bridge.call("read_data", b"force", ctypes.c_double(dt), force, n(6))
        v_new = ((MASS * v + dt * sum(force) - dt * STIFFNESS * (d + 0.25 * dt * v))
                 / (MASS + 0.25 * dt * dt * STIFFNESS))
        d, v = d + 0.5 * dt * (v + v_new), v_new
        bridge.call("write_data", b"displacement", vector(d, 0, d, 0, d, 0), n(6))
        bridge.call("write_data", b"velocity", vector(v, 0, v, 0, v, 0), n(6))
        bridge.call("advance", ctypes.c_double(dt))
        if bridge.ask("requires_reading_checkpoint"):
            d, v = saved
    bridge.call("finalize")
    print(f"{d:.15g}")


if len(sys.argv) == 4 and sys.argv[2] == "--out":
    main(sys.argv[1], sys.argv[3], os.environ.get("SLUICE_LIBRARY", "libsluice.so"))
elif sys.argv[2:] != ["--check"]:
    sys.exit("solid.py: usage: CASE.toml --out DIR, or CASE.toml --check")
