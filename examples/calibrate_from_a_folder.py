"""A camera's lens and mounting from images of a board and the arm's poses at them."""

import vergence as vg

lens = vg.calibrate_lens("board", vg.Board(columns=9, rows=6, square_m=0.02), model="k1")
mounting = vg.calibrate_mounting("board", lens, poses="poses.csv")
print(lens.camera, mounting.T_mount_camera.round(4), mounting.warnings, sep="\n")
