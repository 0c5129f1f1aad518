"""A program that is a robot: real qi services, which print a line of JSON for each call. See robots.py.

Arguments: the port to listen on, and options as JSON. It ends when its standard input does.
"""

import json
import os
import sys
import threading
import time
from typing import Any

import qi

OPTIONS: dict[str, Any] = json.loads(sys.argv[2])
BUSY = threading.Event()


def tell(*what: object) -> None:
    sys.stdout.write(json.dumps(what) + "\n")
    sys.stdout.flush()


def work() -> None:
    """Speak or move, for as long as the options say or until stopped."""
    BUSY.clear()
    BUSY.wait(OPTIONS["seconds"])


@qi.multiThreaded()  # as on the robot: it can be stopped while it speaks
class Speech:
    def say(self, text: str) -> None:
        tell("ALTextToSpeech", "say", text)
        if "unspeakable" in text:
            raise RuntimeError("no voice\nfor this")
        work()
        tell("ALTextToSpeech", "said", text)


@qi.multiThreaded()
class FullSpeech(Speech):
    def setLanguage(self, name: str) -> None:
        tell("ALTextToSpeech", "setLanguage", name)
        if name == "Klingon":
            raise RuntimeError("language is not installed")

    def stopAll(self) -> None:
        tell("ALTextToSpeech", "stopAll")
        BUSY.set()


@qi.multiThreaded()
class Animated:
    def say(self, text: str) -> None:
        tell("ALAnimatedSpeech", "say", text)
        work()


@qi.multiThreaded()
class Player:
    def run(self, name: str) -> None:
        tell("ALAnimationPlayer", "run", name)
        if name not in OPTIONS["animations"]:
            raise RuntimeError(f"animation {name} does not exist")
        work()
        tell("ALAnimationPlayer", "ran", name)


class Manager:
    def getInstalledBehaviors(self) -> list[str]:
        return sorted(OPTIONS["animations"])


class Leds:
    def fadeRGB(self, group: str, colour: int, seconds: float) -> None:
        tell("ALLeds", "fadeRGB", group, colour, seconds)

    def reset(self, group: str) -> None:
        tell("ALLeds", "reset", group)


class Memory:
    def raiseEvent(self, name: str, value: list[str]) -> None:
        tell("ALMemory", "raiseEvent", name, list(value))


SERVICES = {
    "ALTextToSpeech": Speech if OPTIONS["bare"] else FullSpeech,
    "ALAnimatedSpeech": Animated,
    "ALAnimationPlayer": Player,
    "ALBehaviorManager": Manager,
    "ALLeds": Leds,
    "ALMemory": Memory,
}


def listen(session: qi.Session, url: str) -> None:
    """The port of a robot that was killed is free again only after a while."""
    for _ in range(300):
        try:
            session.listenStandalone(url)
        except RuntimeError:
            time.sleep(0.1)
        else:
            return
    sys.exit(f"can't listen on {url}")


def main() -> None:
    qi.logging.setLevel(qi.logging.FATAL)
    session = qi.Session()
    listen(session, f"tcp://127.0.0.1:{sys.argv[1]}")
    kept = {name: SERVICES[name]() for name in OPTIONS["services"]}
    for name, service in kept.items():
        session.registerService(name, service)
    tell("up")
    sys.stdin.read()
    os._exit(0)  # qi's own threads would delay the end


if __name__ == "__main__":
    main()
