"""A camera over a bay: one line in a log per scan; a bad scan does not end the program."""

import json
from pathlib import Path

import divespot
from divespot import simulate

LOG = Path("bay.jsonl")


def log_scan(points) -> None:
    """Measure points of shape (h, w, 3) or (n, 3) in metres, and add a line to the log."""
    try:
        report = divespot.measure(points, material="corn", threads=2)
    except divespot.DivespotError as error:  # a covered lens, no ground in view
        line = {"error": str(error)}
    else:
        line = {
            "mass_kg": report.total.mass_kg,
            "u95_mass_kg": report.total.u95_mass_kg,
            "runs_out_of_view": any(pile.touches_edge for pile in report.piles),
            "warnings": report.warnings,
        }
    with LOG.open("a", encoding="utf-8") as log:
        log.write(json.dumps(line) + "\n")


# Simulated scans in place of a camera's: twice 0.028 m3 of corn (20.2 kg), then a covered lens.
for seed in range(2):
    log_scan(simulate.scan("shape-05", seed=seed, density=0.05).points)
log_scan([[0.0, 0.0, 0.0]] * 100)
print(LOG.read_text(encoding="utf-8"))
