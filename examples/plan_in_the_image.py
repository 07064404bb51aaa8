"""Two images of an object without a model: plan a path between them and plot it."""

from vergence.cell import load_cell
from vergence.planning import OptimisedPlanner, PlanningProblem, Trajectory
from vergence.simulation import SimulatedDriver
from vergence.vision import estimate_two_view


def main() -> None:
    driver = SimulatedDriver(load_cell("gantry"), images=False)
    camera, arm = driver.cameras["eye"], driver.world.arm_to_camera("eye")
    q = driver.read().joints["gantry"].position
    now = driver.first_frame("eye").truth
    there = [-0.26443, 0.305428, 0.159083, 0.0751, 0.1157, -0.1297]  # m, rad: driven to once
    desired = driver.frame_at("eye", "gantry", there)
    assert now is not None
    assert desired.truth is not None
    view = estimate_two_view(now.points_px, desired.truth.points_px, camera)
    if not view:
        raise SystemExit(str(view))
    distance_m = 0.615  # roughly, from the camera to the object: two images have no scale
    problem = PlanningProblem.from_two_view(view, distance_m, arm, camera, q)
    plan = OptimisedPlanner().plan(problem)
    if not plan:
        raise SystemExit(str(plan))
    trajectory = Trajectory.of(plan, camera_speed=0.25)
    print(f"{len(plan.q)} waypoints, {plan.camera_length_m:.2f} m, {trajectory.duration:.1f} s")
    print(f"never nearer than {plan.image_margin_px:.0f} px to the border of the image")
    halfway = trajectory.reference(trajectory.duration / 2)
    print("halfway the first mark should be at", halfway.points_px[0].round(1))


if __name__ == "__main__":
    main()
