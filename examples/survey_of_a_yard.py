"""A survey of a yard: each stockpile in projected coordinates, in a table, with its outline."""

import divespot
from divespot import io, simulate

# A simulated drone scan in UTM coordinates; replace it by your own file.
yard = simulate.scan("utm-yard", density=0.1)
io.write("yard.laz", yard.points)

report = divespot.measure("yard.laz", compare_bases=True)
for pile in report.piles:
    east, north, _ = pile.centroid_m
    share = 100 * pile.u95_m3 / pile.volume_m3
    print(f"{pile.id}  {east:.1f} E  {north:.1f} N  {pile.volume_m3:.1f} m3 ± {share:.1f} %")
    print("   ", {base: round(volume, 1) for base, volume in pile.volume_by_base_m3.items()})

# Next month, measure inside the same outlines, whatever lies in them.
divespot.save_outlines(report, "stockpiles.geojson")
again = divespot.measure("yard.laz", outline="stockpiles.geojson")
print(f"inside the same outlines: {again.total.volume_m3:.1f} m3")
