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


def write(run, outcome, checks, warnings, comparison):
    text = "\n\n".join(part for part in [
        f"# {run.summary['case']}: {outcome}",
        what_was_run(run),
        "## Results\n\n" + comparison,
        markdown_table(["check", "value", "band", ""],
                       [[c.what, c.value, c.band, "ok" if c.holds else "outside"]
                        for c in checks]),
        "## Notes\n\n" + "\n".join(f"- {w}" for w in warnings) if warnings else "",
        "## Counts\n\n" + keyed_table(run, "count", COUNTS),
        "## Balances\n\n" + keyed_table(run, "largest relative difference or drift", BALANCES),
        "## Costs\n\n" + costs(run),
    ] if part)
    (run.path / "summary.md").write_text(text + "\n")


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
    lines.append(f"- started {s.get('started')} on {s.get('processor')}, "
                 f"{s.get('threads')} threads")
    return "\n".join(lines)


def keyed_table(run, header, keys):
    return markdown_table([header, ""], [[text, number(run.summary.get(key))]
                                         for key, text in keys])


def costs(run):
    s = run.summary
    rows = [["whole run, wall time", f"{s['wall_time_s']:.1f} s"],
            ["whole run, CPU time", f"{s['cpu_time_s']:.1f} s"]]
    rows += [[f"{part}, per step", with_unit(s.get(f"ms_per_step_{part}"))]
             for part in ("fluid", "solid", "bridge")]
    for part, phases in (s.get("phases_ms") or {}).items():
        rows += [[f"{part}: {phase}", with_unit(ms)] for phase, ms in phases.items()]
    return markdown_table(["phase", "time"], rows)


def with_unit(milliseconds):
    return None if milliseconds is None else f"{milliseconds:.3g} ms"
