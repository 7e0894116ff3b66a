# SPDX-License-Identifier: MIT
"""The one-page summary.md of a run: what was run, what came out, what it cost, what to look at."""

from compare import markdown_table

COUNTS = [
    ("points", "points at the start"),
    ("steps", "fluid steps"),
    ("windows", "coupling windows"),
    ("failed_windows", "failed windows"),
    ("lost_points", "lost points"),
    ("wall_returns", "points put back through a wall"),
    ("outflow_points", "points that left through the outlet"),
    ("outflow_m2", "water that left through the outlet [m2]"),
    ("coupling_iterations_mean", "coupling iterations per window, mean"),
    ("coupling_iterations_max", "coupling iterations per window, largest"),
    ("guarded_rows_per_step", "guarded rows per step"),
]
BALANCES = [
    ("force_balance_max", "force on both sides of the interface"),
    ("moment_balance_max", "moment on both sides"),
    ("work_balance_max", "virtual work on both sides"),
    ("volume_drift_max", "volume of the water"),
    ("energy_drift", "energy"),
]


def number(value):
    if value is None:
        return None
    if isinstance(value, float):
        return f"{value:.4g}"
    return str(value)


def write(run, verdict):
    """summary.md: of a coupled run, of the fluid alone, or of a solver of its own."""
    checks = [[c.what, c.value, c.band, "ok" if c.holds else "outside"] for c in verdict.checks]
    results = verdict.tables + [(["check", "value", "band", ""], checks)]
    text = "\n\n".join(part for part in [
        f"# {run.summary.get('case', run.path.name)}: {verdict.outcome()}",
        what_was_run(run) if "case_file" in run.summary else "",
        "## Results",
        *[markdown_table(header, rows) for header, rows in results if rows],
        "## Notes\n\n" + "\n".join(f"- {note}" for note in verdict.notes) if verdict.notes else "",
        section("Counts", keyed_rows(run, COUNTS), "count"),
        section("Balances", keyed_rows(run, BALANCES), "largest relative difference or drift"),
        section("Costs", cost_rows(run), "phase"),
    ] if part)
    (run.path / "summary.md").write_text(text + "\n")


def section(title, rows, header):
    return f"## {title}\n\n" + markdown_table([header, ""], rows) if rows else ""


def what_was_run(run):
    s, case = run.summary, run.case()
    lines = [f"- case file: `{s.get('case_file')}`"]
    if s.get("overrides"):
        lines.append("- overrides: " + ", ".join(f"`{o}`" for o in s["overrides"]))
    scene = [f"end {case['case']['end_time_s']:g} s", f"window {case['case']['time_step_s']:g} s"]
    if "fluid" in case:
        scene.append(f"spacing {1e3 * case['fluid']['spacing_m']:g} mm")
    if "bridge" in case:
        bridge = case["bridge"]
        scene.append(", ".join(str(bridge[k]) for k in ("scheme", "acceleration", "iterate")
                               if k in bridge))
    lines.append("- " + "; ".join(scene))
    threads = f", {s['threads']} threads" if "threads" in s else ""
    lines.append(f"- started {s.get('started')} on {s.get('processor')}{threads}")
    return "\n".join(lines)


def keyed_rows(run, keys):
    """Rows of what the run reports."""
    return [[text, number(run.summary[key])] for key, text in keys
            if run.summary.get(key) is not None]


def cost_rows(run):
    s = run.summary
    rows = [[f"whole run, {name} time", f"{s[key]:.1f} s"]
            for name, key in (("wall", "wall_time_s"), ("CPU", "cpu_time_s")) if key in s]
    rows += [[f"{part}, per step", with_unit(s[f"ms_per_step_{part}"])]
             for part in ("fluid", "solid", "bridge") if s.get(f"ms_per_step_{part}") is not None]
    for part, phases in (s.get("phases_ms") or {}).items():
        rows += [[f"{part}: {phase}", with_unit(ms)] for phase, ms in phases.items()]
    return rows


def with_unit(milliseconds):
    return f"{milliseconds:.3g} ms"
