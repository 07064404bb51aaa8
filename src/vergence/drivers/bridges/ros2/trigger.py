"""Services that start or stop a robot."""

from threading import Event
from time import monotonic
from typing import Any

_SERVICE = "std_srvs/srv/Trigger"


def trigger(node: Any, service: str, within_s: float) -> str:
    """Call a service `Trigger`; return why it was not done, in a sentence, or nothing.

    Args:
        node: of the bridge, which another thread spins.
        service: its name.
        within_s: for it to be there and to answer.
    """
    try:
        from std_srvs.srv import Trigger
    except ImportError:
        return f"{service} is a service, and this Python has no std_srvs: install it"
    answered, deadline = Event(), monotonic() + within_s
    client = node.create_client(Trigger, service)
    try:
        while not client.service_is_ready():
            if monotonic() > deadline:
                kinds = dict(node.get_service_names_and_types()).get(service, [])
                other = next((kind for kind in kinds if kind != _SERVICE), "")  # not this client's
                of = f"is of {other}, not of {_SERVICE}" if other else "is not there"
                return f"the service {service} {of}"
            answered.wait(0.02)
        future = client.call_async(Trigger.Request())
        future.add_done_callback(lambda _: answered.set())
        if not answered.wait(max(deadline - monotonic(), 0.0)):
            return f"the service {service} did not answer within {within_s:g} s"
        answer = future.result()
    finally:
        node.destroy_client(client)
    if answer is None or not answer.success:
        said = "" if answer is None or not answer.message else f": {answer.message[:100]}"
        return f"the service {service} refused{said}"
    return ""
