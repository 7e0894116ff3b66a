# SPDX-License-Identifier: MIT
"""A run folder of the elastic gate as the solvers would leave it, from made-up smooth motion.

For tests of reading, judging and drawing; nothing in it was computed by a solver.
"""

import json
from pathlib import Path

import numpy as np

CASE_FILE = Path(__file__).resolve().parents[2] / "cases/elastic-gate/case.toml"
GRAVITY, DENSITY, DEPTH, LENGTH = 9.81, 1000.0, 0.14, 0.1
GATE_X, GATE_WIDTH, GATE_HEIGHT = 0.1, 0.005, 0.079


def tip_ux(t, peak=0.040):
    rise = 1 - np.exp(-(t / 0.055) ** 2.6)
    return peak * rise * (1 - 0.28 * (1 - np.exp(-(np.maximum(t - 0.1, 0) / 0.09) ** 2)))


def tip_uy(t, peak=0.040):
    return 8.0 * tip_ux(t, peak) ** 2


def outflow(t):
    return 0.028 * DEPTH * np.maximum(t - 0.05, 0) / 0.35 * 3 * np.exp(-0.4 * t)


def level(t):
    return DEPTH - outflow(t) / LENGTH * 0.99


def write_csv(path, columns):
    names = list(columns)
    data = np.broadcast_arrays(*columns.values())
    rows = "\n".join(",".join(f"{v:.17g}" for v in row) for row in np.array(data).T)
    path.write_text(",".join(names) + "\n" + rows + ("\n" if rows else ""))


def write_series(folder, end, window, peak):
    t = window * np.arange(1, int(round(end / window)) + 1)
    ux, uy = tip_ux(t, peak), tip_uy(t, peak)
    write_csv(folder / "tip.csv", {
        "time_s": t, "ux_m": ux, "uy_m": uy, "ux_front_m": ux, "uy_front_m": uy - 0.0015,
        "ux_back_m": ux, "uy_back_m": uy + 0.0015})
    start = 0.5 * DENSITY * GRAVITY * DEPTH**2 * LENGTH
    potential = 0.5 * DENSITY * GRAVITY * level(t) ** 2 * LENGTH
    walls = 0.25 * (ux / peak) ** 2
    kinetic = np.maximum(start - potential - walls - 4 * np.maximum(t - 0.05, 0), 0)
    write_csv(folder / "fluid.csv", {
        "time_s": t, "kinetic_j": kinetic, "potential_j": potential, "work_on_walls_j": walls,
        "volume_m2": 0.014 + 0 * t, "outflow_past_tip_m2": outflow(t), "outflow_m2": 0 * t,
        "level_gate_m": level(t) - 0.02 * np.sin(40 * t) * t, "level_5cm_m": level(t),
        "max_speed_m_s": 1.6 + 0 * t})
    write_csv(folder / "solid_energy.csv", {
        "time_s": t, "kinetic_j": 0.02 * np.exp(-((t - 0.05) / 0.02) ** 2),
        "strain_j": 0.9 * walls, "work_j": walls})
    loads = {"window": np.arange(1, len(t) + 1), "time_s": t, "fx_n": 60 * (level(t) / DEPTH),
             "fy_n": 0 * t, "moment_nm": 2 + 0 * t, "magnitude_n": 80 + 0 * t,
             "moment_magnitude_nm": 3 + 0 * t, "work_j": 1e-3 + 0 * t,
             "work_magnitude_j": 2e-3 + 0 * t}
    write_csv(folder / "fluid_loads.csv", loads)
    write_csv(folder / "solid_loads.csv", loads)
    write_csv(folder / "coupling.csv", {"window": np.arange(1, len(t) + 1), "iteration": 3 + 0 * t,
                                        "displacement_residual": 1e-5 + 0 * t,
                                        "force_residual": 1e-4 + 0 * t})


def gate_displacement(x, y, t, peak):
    """A beam clamped at the top that bends away from the water."""
    s = np.clip((GATE_HEIGHT - y) / GATE_HEIGHT, 0, 1)
    shape = s**2 * (3 - s) / 2
    slope = 1.5 * tip_ux(t, peak) / GATE_HEIGHT * (s - s**2 / 2) * 2
    ux = shape * tip_ux(t, peak)
    uy = s**1.5 * tip_uy(t, peak)
    return ux, uy + (x - GATE_X - GATE_WIDTH / 2) * np.minimum(slope, 0.6)


def fluid_points(t, spacing, peak):
    h = level(t)
    x, y = np.meshgrid(np.arange(spacing / 2, 0.16, spacing), np.arange(spacing / 2, h, spacing))
    x, y = x.ravel(), y.ravel()
    front, _ = gate_displacement(np.full_like(y, GATE_X), y, t, peak)
    inside = x < GATE_X + front - spacing / 2
    x, y = x[inside], y[inside]
    pressure = DENSITY * GRAVITY * (h - y)
    tongue = 0.1 + tip_ux(t, peak)
    reach = 1.5 * max(t - 0.05, 0)
    jet_x, jet_y = np.meshgrid(np.arange(tongue, tongue + reach, spacing),
                               np.arange(spacing / 2, 0.012, spacing))
    jet_x, jet_y = jet_x.ravel(), jet_y.ravel()
    thin = jet_y < 0.012 * (1 - 0.7 * (jet_x - tongue) / max(reach, 1e-9))
    jet_x, jet_y = jet_x[thin], jet_y[thin]
    position = np.column_stack([np.concatenate([x, jet_x]), np.concatenate([y, jet_y])])
    return position, np.concatenate([pressure, 30 + 0 * jet_x])


def write_fields(folder, end, interval, spacing, peak):
    """The .vtp and .vtu files with their collections."""
    import vtkmodules.vtkIOXML as io
    entries = {"fluid": [], "solid": []}
    for k in range(int(round(end / interval)) + 1):
        t = k * interval
        for part, suffix, writer, data in [
                ("fluid", "vtp", io.vtkXMLPolyDataWriter(), cloud_data(t, spacing, peak)),
                ("solid", "vtu", io.vtkXMLUnstructuredGridWriter(), gate_data(t, peak))]:
            name = f"{part}_{k:06d}.{suffix}"
            writer.SetFileName(str(folder / name))
            writer.SetInputData(data)
            writer.Write()
            entries[part].append(f'<DataSet timestep="{t:.17g}" part="0" file="{name}"/>')
    for part, lines in entries.items():
        (folder / f"{part}.pvd").write_text(
            '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n<Collection>\n'
            + "\n".join(lines) + "\n</Collection>\n</VTKFile>\n")


def with_points(data, position):
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonCore import vtkPoints
    points = vtkPoints()
    points.SetData(numpy_to_vtk(np.column_stack([position, 0 * position[:, :1]]), deep=True))
    data.SetPoints(points)
    return data


def cloud_data(t, spacing, peak):
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonDataModel import vtkPolyData
    position, pressure = fluid_points(t, spacing, peak)
    data = with_points(vtkPolyData(), position)
    array = numpy_to_vtk(pressure, deep=True)
    array.SetName("pressure")
    data.GetPointData().AddArray(array)
    return data


def gate_data(t, peak, along=28):
    from vtkmodules.vtkCommonDataModel import VTK_QUAD, vtkUnstructuredGrid
    corners = []
    for k in range(along):  # every cell has its own nodes, as deal.II writes them
        low, high = GATE_HEIGHT * k / along, GATE_HEIGHT * (k + 1) / along
        corners += [[0, low], [GATE_WIDTH, low], [GATE_WIDTH, high], [0, high]]
    corners = np.array(corners) + [GATE_X, 0]
    ux, uy = gate_displacement(corners[:, 0], corners[:, 1], t, peak)
    data = with_points(vtkUnstructuredGrid(), corners + np.column_stack([ux, uy]))
    for k in range(along):
        data.InsertNextCell(VTK_QUAD, 4, [4 * k, 4 * k + 1, 4 * k + 2, 4 * k + 3])
    return data


def write_summary(folder, overrides, **changes):
    summary = {
        "case": "elastic-gate", "case_file": "case.toml", "overrides": overrides,
        "started": "2000-01-01T00:00:00Z", "processor": "made up", "threads": 2, "completed": True,
        "points": 3500, "steps": 2000, "windows": 2000, "failed_windows": 0, "lost_points": 0,
        "outflow_points": 0, "wall_returns": 0, "wall_time_s": 60.0, "cpu_time_s": 110.0,
        "ms_per_step_fluid": 20.0, "ms_per_step_solid": 2.0, "ms_per_step_bridge": 0.5,
        "phases_ms": {"fluid": {"pressure": 8.0, "neighbours": 3.0}, "solid": {"newton": 1.5}},
        "coupling_iterations_mean": 3.4, "coupling_iterations_max": 7,
        "force_balance_max": 1e-14, "moment_balance_max": 1e-14, "work_balance_max": 1e-14,
        "volume_drift_max": 0.004, "energy_drift": -0.05, "guarded_rows_per_step": 12.0,
        "outflow_m2": 0.0}
    summary.update(changes)
    (folder / "summary.json").write_text(json.dumps(summary))


def write_run(folder, end=0.4, window=2e-4, interval=0.04, spacing=0.004, peak=0.040, fields=True,
              **summary_changes):
    """Makes `folder` a complete run; `summary_changes` overwrite keys of summary.json."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "case.toml").write_text(CASE_FILE.read_text())
    write_series(folder, end, window, peak)
    if fields:
        write_fields(folder, end, interval, spacing, peak)
    overrides = [f"case.end_time_s={end}", f"case.time_step_s={window}",
                 f"fluid.spacing_m={spacing}"]
    write_summary(folder, overrides, **summary_changes)
    return folder
