"""Procedurally generated expressive motion: what the bundled `demo` model is trained on.

Read in this order: `channels` (what carries an emotion), `gestures` (what arms do), `person`, `scene` and `manner`
(who, where, how), `script` (what happens when), `body` (the joints), `sensing` (the sensor), `observers` (the label),
`dataset` (all of it together). It is motion of our own making, not anybody's recording, and no science about people.
"""

from fervor_export.synthetic.dataset import synthesise_dataset
from fervor_export.synthetic.motion import synthesise_motion

__all__ = ["synthesise_dataset", "synthesise_motion"]
