"""The course of a training, drawn."""

from xml.etree import ElementTree as ET

from fervor_export.curves import curves
from fervor_export.scores import Scores
from fervor_export.trainer import Epoch

SCORES = Scores(mae=0.2, r=0.4, r_within=0.3, ccc=0.35, spread=0.8)


def history(*validated: bool) -> list[Epoch]:
    return [
        Epoch(number, 0.5 / number, 0.3 / number, SCORES if judged else None, 1.0 * number)
        for number, judged in enumerate(validated, start=1)
    ]


def test_the_same_epochs_are_the_same_picture():
    drawn = curves(history(True, True, True), kept=2)
    assert ET.fromstring(drawn).tag.endswith("svg")
    assert drawn == curves(history(True, True, True), kept=2)
    assert drawn != curves(history(True, True, True), kept=3)


def test_without_validation_and_with_one_epoch():
    for epochs in (history(False, False), history(True), history(False)):
        ET.fromstring(curves(epochs, kept=1))
