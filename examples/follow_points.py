"""Follow points through the images of a folder."""

import vergence as vg

for frame, points in vg.track_points("frames", count=20):
    print(f"{frame.time:.2f} s", points.points_px[points.found].round(1).tolist())
