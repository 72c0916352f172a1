"""Find the loosest tolerances with which the tool is within 0.1 mm, and rank what they cost."""

import math

import explorer
from explorer.statics.accuracy import SOURCES
from explorer.statics.budget import PARTS, tolerance_budget

design = explorer.PRESETS["paper-optimal"]
home = explorer.Configuration.at(design, design.home_pose, design.tool.position)
found = tolerance_budget(home, wanted=0.1)

costs = found.costs
print(f"worst displacement {costs.worst_displacement:.4f} mm, RMS {costs.rms_displacement:.4f} mm")
for k in costs.ranking[:10]:
    tolerance = found.tolerances[k]
    text = "any" if math.isinf(tolerance) else f"±{tolerance:g}"
    print(f"{PARTS[k]:>18}  {SOURCES[k]:<12} {text:>10}  {100 * costs.shares[k]:5.1f} %")
