"""Two laws from the same twenty random starts, in one table."""

import vergence as vg

table = vg.compare("ur5", laws=["image_based", "own"], starts=20, duration_s=4)
print(table)
print("the fourth run:", table.runs[3].outcome)
