"""The paper's method beside the instrument's, and other volume methods, on one simulated pile."""

import divespot
from divespot import Settings, simulate
from divespot.volume import METHODS, volumes_m3

scan = simulate.scan("shape-10", density=0.05)
truth_m3 = scan.volume_m3


def error(volume_m3: float) -> str:
    return f"{100 * (volume_m3 / truth_m3 - 1):+.2f} %"


ours = divespot.measure(scan.points)
paper = divespot.measure(scan.points, Settings.paper())
print("instrument      ", error(ours.total.volume_m3))
print("paper, factor 1 ", error(paper.total.volume_m3))
for method in METHODS:
    print(f"{method:16}", error(sum(volumes_m3(ours, method))))
