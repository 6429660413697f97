"""Check of a model's start: what the robot penetrates before it has moved."""

from robot_side.drivers.mujoco.scene import Scene

_DEEP_M = 1e-3
_NAMED = 3
"""Most pairs that a line names."""


def start_collision(scene: Scene) -> list[str]:
    """Return a line if the robot penetrates an object or itself by more than 1 mm, else nothing.

    The scene's live state must have been computed with `mj_forward`.
    """
    model, data = scene.model, scene.data
    object_of = {geom: thing.name for thing in scene.objects for geom in thing.geoms}
    deepest_m: dict[tuple[str, str], float] = {}
    for contact in data.contact:
        # The robot's part first.
        first, second = sorted((int(geom) for geom in contact.geom), key=lambda geom: geom in object_of)
        body = int(model.geom_bodyid[first])
        if contact.dist < -_DEEP_M and model.body_rootid[body] == scene.robot.root_body:
            other = object_of.get(second) or model.body(int(model.geom_bodyid[second])).name
            pair = model.body(body).name or f"body{body}", other
            deepest_m[pair] = max(deepest_m.get(pair, 0.0), -float(contact.dist))
    if not deepest_m:
        return []
    worst = sorted(deepest_m.items(), key=lambda item: -item[1])
    shown = [f"{ours!r} is {1e3 * deep_m:.0f} mm inside {other!r}" for (ours, other), deep_m in worst[:_NAMED]]
    if len(worst) > len(shown):
        shown.append(f"and {len(worst) - len(shown)} more")
    return [f"it starts in collision: {', '.join(shown)} (to choose another start: a keyframe named 'home')"]
