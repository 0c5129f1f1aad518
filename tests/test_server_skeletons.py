"""The catalogue over HTTP."""

from fervor.skeletons.catalog import SKELETONS
from fervor.skeletons.landmarks import LANDMARKS


def test_every_source_is_listed_with_what_it_sends_and_sees(http):
    listed = {entry["name"]: entry for entry in http.get("/v1/skeletons").json()}
    assert set(listed) == {*SKELETONS, *LANDMARKS}
    kinect, webcam = listed["kinect_v2"], listed["mediapipe"]
    assert (kinect["sends"], kinect["axes"], len(kinect["joints"]), kinect["unseen"]) == ("rotations", "global", 25, [])
    assert (webcam["sends"], webcam["axes"], len(webcam["joints"])) == ("positions", None, 33)
    assert set(listed["coco17"]["unseen"]) == {"l_wrist", "r_wrist"}
    assert "l_wrist" in listed["ros4hri"]["unseen"]
