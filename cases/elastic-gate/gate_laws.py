# SPDX-License-Identifier: MIT
"""Runs of the elastic gate by law, element, modulus and solver: their keys, table and figure."""

import csv
import datetime
import json
import shutil
from dataclasses import asdict, dataclass, fields

import gate
import gate_study as study
from compare import markdown_table, rms_difference
from figures import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, RED, SKY, new_figure, save
from run_folder import RunFolder

QUICK_KEYS = ("fluid.spacing_m=0.004", "case.time_step_s=5e-4", "case.end_time_s=0.05")
SVK = "solid.material=st-venant-kirchhoff"
CCX = "solid.program=sluice-calculix"


def rubber(c10, c01, nu):
    return ("solid.material=mooney-rivlin", f"solid.c10_pa={c10:g}", f"solid.c01_pa={c01:g}",
            f"solid.poisson_ratio={nu:g}")


@dataclass(frozen=True)
class Row:
    """One run: the keys that differ from the case file, and how it is drawn."""

    name: str
    solver: str
    element: str
    law: str
    bending_modulus_pa: float  # E/(1 - nu^2) of small plane strain; what bends a thin gate
    keys: tuple
    colour: str
    line: str = "-"

    def overrides(self):
        # A machine that is stopped for a while must not end a run of hours.
        return [*self.keys, "case.output_interval_s=0", "bridge.silence_deadline_s=3600"]

    def case_text(self):
        """The case file without what the row's law has no use for."""
        has_modulus = not any("c10_pa" in key for key in self.keys)
        return "".join(line for line in study.CASE_FILE.read_text().splitlines(keepends=True)
                       if has_modulus or not line.startswith("youngs_modulus_pa"))

    @property
    def label(self):
        return f"{self.solver}, {self.element}, {self.law}"


def plane_strain(modulus, nu):
    return modulus / (1 - nu**2)


# Equal small-strain modulus: 2 (c10 + c01) = E/(2 (1 + nu)) 2 with E 12 MPa, nu 0.4; c01 = c10/4 is
# the ratio of the published rubber, reference/SOURCE.md.
EQUAL_C10 = 0.8 * 12e6 / (4 * 1.4)
SHORE_70 = (0.738e6, 0.184e6, 0.499)
ROWS = [
    Row("neo-hookean", "deal.II", "incompatible modes", "neo-Hookean", plane_strain(12e6, 0.4),
        (), RED),
    Row("svk", "deal.II", "incompatible modes", "St. Venant-Kirchhoff", plane_strain(12e6, 0.4),
        (SVK,), BLUE, "--"),
    Row("mooney-rivlin", "deal.II", "incompatible modes", "Mooney-Rivlin of the same modulus",
        plane_strain(12e6, 0.4), rubber(EQUAL_C10, EQUAL_C10 / 4, 0.4), GREEN, ":"),
    Row("column", "deal.II", "incompatible modes, 28 x 2 hexahedra", "neo-Hookean",
        plane_strain(12e6, 0.4), ("solid.dimension=3", "solid.interface=plane",
                                  "solid.depth_m=0.02", "solid.elements_deep=2"), GREY, ":"),
    Row("ccx-c3d8i", "ccx", "C3D8I", "St. Venant-Kirchhoff", plane_strain(12e6, 0.4),
        (CCX, SVK), SKY, "-."),
    Row("ccx-c3d8", "ccx", "C3D8", "St. Venant-Kirchhoff", plane_strain(12e6, 0.4),
        (CCX, SVK, "solid.element=q1"), PURPLE, "-"),
    Row("q1", "deal.II", "Q1", "St. Venant-Kirchhoff", plane_strain(12e6, 0.4),
        (SVK, "solid.element=q1"), BLACK, ":"),
    Row("svk-7.8", "deal.II", "incompatible modes", "St. Venant-Kirchhoff, 7.8 MPa, nu 0.47",
        plane_strain(7.8e6, 0.47),
        (SVK, "solid.youngs_modulus_pa=7.8e6", "solid.poisson_ratio=0.47"), GREY, "--"),
    Row("shore-70", "deal.II", "Q2-P1", "Mooney-Rivlin, rubber of 70 Shore A",
        plane_strain(4 * (1 + SHORE_70[2]) * (SHORE_70[0] + SHORE_70[1]), SHORE_70[2]),
        (*rubber(*SHORE_70), "solid.element=q2-p1"), ORANGE),
]


@dataclass(frozen=True)
class Outcome:
    """What is known of one run; None where it did not get that far."""

    name: str
    completed: bool
    reached_s: float
    cause: str
    date: str
    commit: str
    peak_ux_m: float = None
    peak_ux_time_s: float = None
    peak_uy_m: float = None
    min_ux_after_peak_m: float = None
    rms_ux_m: float = None
    ux_early_m: float = None
    iterations_mean: float = None
    iterations_max: int = None
    fluid_cpu_s: float = None
    solid_cpu_s: float = None


def run_row(row, folder, limit_s, is_quick=False):
    """The outcome of a run, or of the one on record."""
    record = folder / "outcome.json"
    if record.is_file():
        return Outcome(**json.loads(record.read_text()))
    shutil.rmtree(folder, ignore_errors=True)
    case_file = folder.parent / f"{row.name}.toml"
    case_file.write_text(row.case_text())
    quick = [word for key in QUICK_KEYS for word in ("--set", key)] if is_quick else []
    stopped_by = study.execute(row, folder, limit_s, case_file, ["--threads", "1", *quick])
    outcome = read_outcome(row, RunFolder(folder), stopped_by)
    record.write_text(json.dumps(asdict(outcome), indent=2) + "\n")
    return outcome


def read_outcome(row, run, stopped_by):
    tip, reached = study.tip_values(run)
    s = run.summary
    cpu = {name: p.get("cpu_time_s") for name, p in s.get("participants", {}).items()}
    return Outcome(
        row.name, bool(s.get("completed")) and not stopped_by, reached,
        stopped_by or study.first_failure(s), datetime.date.today().isoformat(), study.commit(),
        **tip, peak_uy_m=float(gate.read_tip(run).uy.peak()[0]) if tip else None,
        iterations_mean=s.get("coupling_iterations_mean"),
        iterations_max=s.get("coupling_iterations_max"),
        fluid_cpu_s=cpu.get("fluid"), solid_cpu_s=cpu.get("solid"))


def difference(folder, name, reference):
    """rms of the x displacement of two runs over the time that both reached [m]."""
    mine, other = (gate.read_tip(RunFolder(folder / n)).ux for n in (name, reference))
    return rms_difference(mine, other)[0]


def table(outcomes, folder):
    rows = {row.name: row for row in ROWS}
    has_reference = any(o.name == ROWS[0].name for o in outcomes)

    def cells(o):
        row = rows[o.name]
        against = difference(folder, o.name, ROWS[0].name) if has_reference else None
        return [row.solver, row.element, row.law, f"{1e-6 * row.bending_modulus_pa:.1f}",
                study.result(o), study.shown(o.ux_early_m, 1e3, 2),
                study.shown(o.peak_ux_m, 1e3, 2), study.shown(o.peak_ux_time_s, 1, 4),
                study.shown(o.peak_uy_m, 1e3, 2), study.shown(o.min_ux_after_peak_m, 1e3),
                study.shown(against, 1e3, 2), study.shown(o.rms_ux_m, 1e3),
                f"{o.iterations_mean:.1f} ({o.iterations_max})" if o.iterations_mean else None,
                study.shown(o.fluid_cpu_s, digits=0), study.shown(o.solid_cpu_s, digits=0)]
    return markdown_table(
        ["solver", "element", "law", "E/(1 - nu^2) MPa", "result", "x at 0.06 s mm", "peak x mm",
         "at s", "peak y mm", "then min x mm", "rms x to the first row mm",
         "rms x to experiment mm", "iterations mean (max)", "CPU s fluid", "CPU s solid"],
        [cells(o) for o in outcomes])


def draw(outcomes, folder):
    experiment = gate.read_experiment()
    figure, axes = new_figure(10.4, 4.0, 1, 2, gridspec_kw={"wspace": 0.22})
    rows = {row.name: row for row in ROWS}
    for ax, component, uncertainty, name in [
            (axes[0], "ux", experiment.ux_uncertainty, "horizontal"),
            (axes[1], "uy", experiment.uy_uncertainty, "vertical")]:
        measured = getattr(experiment.tip, component)
        ax.errorbar(measured.time, 1e3 * measured.value, yerr=1e3 * uncertainty, fmt="o",
                    color=BLACK, markersize=3.8, capsize=2.2, elinewidth=0.8, zorder=4,
                    label="experiment, Antoci et al. 2007")
        for o in outcomes:
            row, curve = rows[o.name], getattr(gate.read_tip(RunFolder(folder / o.name)), component)
            ax.plot(curve.time, 1e3 * curve.value, color=row.colour, linestyle=row.line,
                    linewidth=1.4, label=row.label)
        ax.set(xlabel="time [s]", ylabel=f"{name} displacement of the tip [mm]")
        ax.set_ylim(bottom=-2)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="upper center", ncol=2, bbox_to_anchor=(0.5, 0.02))
    return save(figure, folder / "laws.png")


def write(outcomes, folder):
    """Table, values and figure of what there is; returns the figure's path."""
    (folder / "laws.md").write_text(f"{study.origin(outcomes)}\n\n{table(outcomes, folder)}\n")
    with (folder / "laws.csv").open("w", newline="") as file:
        file.write(f"# {study.origin(outcomes)}\n")
        writer = csv.DictWriter(file, [f.name for f in fields(Outcome)])
        writer.writeheader()
        writer.writerows(asdict(o) for o in outcomes)
    return draw(outcomes, folder)
