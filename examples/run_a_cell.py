"""Run a cell with one number changed, and plot the error in the image."""

import matplotlib.pyplot as plt

import vergence as vg

run = vg.run("puma560", duration_s=2, target=dict(motion=dict(velocity_m_s=[0.2, 0, 0])))
wrist = run.cameras["wrist"]
plt.plot(wrist.time, wrist.error_px)
plt.savefig("error.svg")
print(run.outcome)
