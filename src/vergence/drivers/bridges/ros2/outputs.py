"""Outputs such as a gripper, each behind a topic or a service."""

from collections.abc import Mapping, Sequence
from typing import Any

from std_msgs.msg import Bool, Float64, Float64MultiArray

_TYPES = {
    "std_msgs/msg/Bool": Bool,
    "std_msgs/msg/Float64": Float64,
    "std_msgs/msg/Float64MultiArray": Float64MultiArray,
}
_SERVICE = "std_srvs/srv/SetBool"
_ON = 0.5  # of an output's value, 0 to 1


class Outputs:
    """Publishes the values of outputs, in the type of message that is listened to.

    Where nobody listens to a topic but a service `SetBool` has its name, that is called.

    Args:
        node: of the bridge.
        topics: by name; or services.
        values: what a topic of numbers is told at 0 and at 1, by name; 0 and 1 if absent.

    Attributes:
        refused: what a service answered that did not do as it was told; empty if all did.
    """

    def __init__(
        self, node: Any, topics: Mapping[str, str], values: Mapping[str, Sequence[float]]
    ) -> None:
        self._node, self._topics, self._values = node, topics, values
        self._publishers: dict[str, Any] = {}
        self._clients: dict[str, Any] = {}
        self.refused = ""

    def missing(self) -> str:
        """Return which output nobody listens to, in a sentence; prepare those that have ears."""
        for name, topic in self._topics.items():
            listeners = self._node.get_subscriptions_info_by_topic(topic)
            kinds = sorted({listener.topic_type for listener in listeners})
            if not kinds:
                if lacking := self._missing_service(name, topic):
                    return lacking
                continue
            if kinds[0] not in _TYPES:
                known = ", ".join(_TYPES)
                return f"{topic}, the topic of output {name}, is of {kinds[0]}, not of {known}"
            if name not in self._publishers:
                kind = _TYPES[kinds[0]]
                self._publishers[name] = self._node.create_publisher(kind, topic, 1)
        return ""

    def set(self, name: str, value: float) -> None:
        """Publish the value, 0 to 1, of an output."""
        if name in self._clients:
            self._call(name, value >= _ON)
            return
        publisher = self._publishers[name]
        if publisher.msg_type is Bool:
            publisher.publish(Bool(data=value >= _ON))
            return
        low, high = self._values.get(name, (0.0, 1.0))
        number = low + value * (high - low)
        array = publisher.msg_type is Float64MultiArray
        publisher.publish(publisher.msg_type(data=[number] if array else number))

    def _missing_service(self, name: str, service: str) -> str:
        """Return why an output is no service, in a sentence; prepare one that is there."""
        if name in self._clients:
            return ""
        kinds = dict(self._node.get_service_names_and_types()).get(service, [])
        if not kinds:
            return f"no node listens on {service}, the topic of output {name}"
        if kinds[0] != _SERVICE:
            return f"{service}, the service of output {name}, is of {kinds[0]}, not of {_SERVICE}"
        try:
            from std_srvs.srv import SetBool
        except ImportError:
            return f"output {name} is a service, and this Python has no std_srvs: install it"
        self._clients[name] = self._node.create_client(SetBool, service)
        return ""

    def _call(self, name: str, on: bool) -> None:
        """Call a service; what it refuses is noted when it answers."""
        client = self._clients[name]
        client.call_async(client.srv_type.Request(data=on)).add_done_callback(
            lambda answer: self._hear(name, answer.result())
        )

    def _hear(self, name: str, answer: Any) -> None:
        if answer is None or not answer.success:
            said = "" if answer is None else f": {answer.message[:100]}"
            self.refused = f"the service {self._topics[name]} of output {name} refused{said}"
