"""Follow any joint rates as far as position, rate and acceleration limits allow."""

from pathlib import Path

import vergence as vg

arm = vg.Arm.from_urdf(Path(__file__).with_name("my_arm.urdf"), tip="tool0")
guard = vg.Guard(arm, [0, -1.2, 1.5, -1.6, -1.5, 0], period_s=0.002)
for _ in range(1000):
    setpoint = guard.step([9, 0, 0, 0, 0, 0])  # for your controller, every period
print("shoulder_pan stops at", setpoint.position[0].round(3), "of", arm.q_max[0])
