"""The topics of the node, as REP-155 has them. `{humans}` is the parameter of that name, `{id}` that of a human."""

from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, slots=True)
class Topic:
    """A topic, or one for every human."""

    name: str
    type: str
    use: str
    """In a few words."""
    latched: bool = False
    """Whether its last message is kept for those who come later."""

    def of(self, humans: str, human: str = "") -> str:
        """Its name, for one human where it is one each."""
        return self.name.format(humans=humans.rstrip("/"), id=human)


Source = Literal["joint_states", "tf", "joint_rotations"]
"""Where poses come from."""

BODIES = Topic("{humans}/bodies/tracked", "hri_msgs/msg/IdsList", "bodies there are", latched=True)
FACES = Topic("{humans}/faces/tracked", "hri_msgs/msg/IdsList", "faces there are", latched=True)
PERSONS = Topic("{humans}/persons/tracked", "hri_msgs/msg/IdsList", "persons there are", latched=True)
BODY_OF_PERSON = Topic("{humans}/persons/{id}/body_id", "std_msgs/msg/String", "the person's body", latched=True)
FACE_OF_PERSON = Topic("{humans}/persons/{id}/face_id", "std_msgs/msg/String", "the person's face", latched=True)
FACE_EXPRESSION = Topic("{humans}/faces/{id}/expression", "hri_msgs/msg/Expression", "what the face shows")
PERSON_EXPRESSION = Topic("{humans}/persons/{id}/expression", "hri_msgs/msg/Expression", "what the person shows")
JOINT_STATES = Topic("{humans}/bodies/{id}/joint_states", "sensor_msgs/msg/JointState", "poses: angles of the URDF")
JOINT_ROTATIONS = Topic(
    "{humans}/bodies/{id}/joint_rotations", "sensor_msgs/msg/MultiDOFJointState", "poses: a quaternion a joint"
)
TF = Topic("/tf", "tf2_msgs/msg/TFMessage", "poses: frames of the bodies")
TF_STATIC = Topic("/tf_static", "tf2_msgs/msg/TFMessage", "fixed frames of the bodies", latched=True)

INTENSITY = Topic("{humans}/bodies/{id}/intensity", "fervor_msgs/msg/Intensity", "one for every pose")
DIAGNOSTICS = Topic("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", "how the node fares")

IN = (
    BODIES, JOINT_STATES, TF, TF_STATIC, JOINT_ROTATIONS,
    PERSONS, BODY_OF_PERSON, FACE_OF_PERSON, PERSON_EXPRESSION, FACES, FACE_EXPRESSION,
)  # fmt: skip
OUT = (INTENSITY, DIAGNOSTICS)
