"""What carries an emotion's intensity in the body, as one table: emotion → channel → (weak, strong, spread).

`weak` is the channel's value at intensity 0, `strong` at intensity 1; between them it runs straight (multipliers: in
the logarithm). `spread` is how far people differ in `strong`: the same intensity looks different in two people. A
channel that a row doesn't name stays at its neutral value, so at intensity 0 all emotions look nearly alike.

The direction of each entry is taken from studies of movement and its perception; the sizes are chosen so that motion
falls into the range of motion capture. W = Wallbott 1998, M = de Meijer 1989, P = Pollick et al. 2001, R = Roether et
al. 2009, G = Gross et al. 2010 and 2012, C = Crane & Gross 2013, D = Dael et al. 2012, V = Volkova et al. 2014,
N = Montepare et al. 1999, A = Atkinson et al. 2004, T = Tracy & Robins 2004 (pride, shame), L = Niewiadomski et al.
2014 and Griffin et al. 2015 (laughter), H = Halovic & Kroos 2018 (gait), K = Kleinsmith & Bianchi-Berthouze 2013,
X = Castellano et al. 2007. An entry without a letter is judgement.
"""

Row = dict[str, tuple[float, float, float]]

TABLE: dict[str, Row] = {
    "neutral": {},
    "joy": {
        "slump": (0, -9, 4),  # W D: upright; G: trunk extended
        "lean": (0, 2, 4),
        "head": (0, -11, 6),  # W: head back in elation
        "tilt": (3, 6, 3),
        "shrug": (0, 0.005, 0.01),  # W raised in elation, G lowered in joy: open
        "reach": (1, 1.6, 0.25),  # M W P: large; V: span
        "height": (0, 0.17, 0.06),  # M: upward
        "width": (0, 26, 10),  # M W: opening; K: expansion
        "tempo": (1, 1.4, 0.15),  # P R A: fast
        "rate": (0.4, 0.8, 0.18),  # W X: activity
        "jerk": (0.2, 0.38, 0.12),  # N: less jerky than anger
        "hold": (1, 0.7, 0.2),
        "emblem": (0.05, 0.75, 0.15),
        "trunk": (0.35, 0.85, 0.2),  # A D: whole body
        "bounce": (0, 4, 1.6),  # H: bouncing
        "sway": (1, 1.6, 0.3),
        "nod": (1, 1.8, 0.4),
        "swing": (1, 1.5, 0.3),  # R C H
        "cadence": (1, 1.12, 0.05),  # G C
        "stride": (1, 1.14, 0.06),  # G C
    },
    "amusement": {
        "slump": (0, 8, 9),  # L: bending over, or leaning back
        "lean": (0, 3, 9),
        "head": (0, -5, 11),
        "tilt": (3, 9, 4),
        "shrug": (0, 0.03, 0.015),  # L: shoulders
        "reach": (1, 1.2, 0.25),
        "height": (0, 0.05, 0.06),
        "width": (0, 8, 10),
        "tempo": (1, 1.3, 0.18),
        "rate": (0.4, 0.6, 0.18),
        "jerk": (0.2, 0.35, 0.12),
        "emblem": (0.05, 0.75, 0.15),
        "trunk": (0.35, 0.8, 0.2),
        "bounce": (0, 1.2, 0.8),
        "laugh": (0, 0.75, 0.18),  # L
        "sway": (1, 1.6, 0.3),
        "breath": (1, 1.6, 0.3),
        "nod": (1, 1.7, 0.4),
        "swing": (1, 1.2, 0.25),
        "cadence": (1, 0.97, 0.06),
    },
    "anger": {
        "slump": (0, -1, 4),
        "lean": (0, 9, 4),  # M: forward; D
        "head": (0, 4, 7),  # D: head forward; R
        "aside": (4, 3, 3),
        "shrug": (0, 0.025, 0.012),  # W: shoulders up
        "reach": (1, 1.4, 0.25),  # M W P
        "height": (0, 0.05, 0.07),
        "width": (0, 20, 10),  # W: lateral arms; K
        "tempo": (1, 1.75, 0.2),  # P A V: fastest
        "rate": (0.4, 0.95, 0.2),
        "jerk": (0.2, 0.95, 0.15),  # N P: jerk
        "hold": (1, 0.55, 0.2),
        "emblem": (0.05, 0.78, 0.15),
        "trunk": (0.35, 0.9, 0.2),
        "tremble": (0, 0.6, 0.4),
        "sway": (1, 1.4, 0.3),
        "breath": (1, 1.5, 0.3),
        "nod": (1, 1.9, 0.4),
        "swing": (1, 1.45, 0.3),  # R C H
        "cadence": (1, 1.18, 0.06),  # H: faster cadence than joy
        "stride": (1, 1.13, 0.06),
    },
    "disgust": {
        "slump": (0, 5, 5),
        "lean": (0, -8, 4),  # M: backing off; A D
        "head": (0, 2, 8),
        "aside": (4, 30, 10),  # A D: turning away
        "tilt": (3, 8, 4),
        "shrug": (0, 0.02, 0.012),
        "reach": (1, 0.95, 0.18),  # W: little movement
        "width": (0, -4, 10),
        "tempo": (1, 1.2, 0.18),
        "rate": (0.4, 0.45, 0.12),
        "jerk": (0.2, 0.5, 0.15),
        "hold": (1, 1.3, 0.25),
        "emblem": (0.05, 0.8, 0.15),
        "trunk": (0.35, 0.6, 0.2),
        "nod": (1, 1.3, 0.3),
        "start": (0, 0.45, 0.25),
        "swing": (1, 0.85, 0.2),
        "stride": (1, 0.95, 0.06),
    },
    "fear": {
        "slump": (0, 13, 6),  # W A: shrinking
        "lean": (0, -11, 6),  # M A: retreat
        "head": (0, -1, 8),
        "aside": (4, 13, 7),  # looking about
        "shrug": (0, 0.05, 0.015),  # D R: shoulders up, tensed
        "reach": (1, 0.75, 0.2),
        "height": (0, 0.18, 0.06),  # D: hands up
        "width": (0, -13, 8),  # D K: arms held in
        "tempo": (1, 1.4, 0.3),
        "rate": (0.4, 0.34, 0.15),
        "jerk": (0.2, 0.7, 0.18),
        "hold": (1, 2.0, 0.4),  # freezing
        "emblem": (0.05, 0.85, 0.12),
        "trunk": (0.35, 0.5, 0.2),
        "tremble": (0, 2.2, 0.7),
        "sway": (1, 1.4, 0.4),
        "breath": (1, 1.9, 0.4),
        "nod": (1, 1.5, 0.5),
        "start": (0, 0.9, 0.3),
        "swing": (1, 0.45, 0.2),  # H R: lower arms only
        "cadence": (1, 1.1, 0.1),  # H: short, fast
        "stride": (1, 0.78, 0.08),
    },
    "pride": {
        "slump": (0, -13, 4),  # T: expanded chest
        "lean": (0, -4, 3),
        "head": (0, -13, 5),  # T: head back
        "shrug": (0, -0.005, 0.01),
        "reach": (1, 1.2, 0.2),
        "height": (0, 0.02, 0.05),
        "width": (0, 34, 10),  # T: arms akimbo
        "tempo": (1, 0.85, 0.12),
        "rate": (0.4, 0.36, 0.12),
        "jerk": (0.2, 0.12, 0.06),
        "hold": (1, 2.1, 0.4),
        "emblem": (0.05, 0.85, 0.12),
        "trunk": (0.35, 0.4, 0.15),
        "sway": (1, 0.65, 0.15),
        "breath": (1, 1.3, 0.2),
        "nod": (1, 0.8, 0.2),
        "swing": (1, 1.2, 0.2),
        "cadence": (1, 0.97, 0.04),
        "stride": (1, 1.1, 0.05),
    },
    "relief": {
        "slump": (0, 11, 6),  # D: release of tension
        "lean": (0, -6, 5),
        "head": (0, 0, 14),  # back, or down: by person
        "tilt": (3, 6, 4),
        "shrug": (0, -0.02, 0.01),
        "reach": (1, 0.9, 0.2),
        "height": (0, -0.03, 0.05),
        "tempo": (1, 0.64, 0.1),
        "rate": (0.4, 0.24, 0.1),
        "jerk": (0.2, 0.05, 0.05),
        "hold": (1, 1.4, 0.3),
        "emblem": (0.05, 0.85, 0.12),
        "trunk": (0.35, 0.5, 0.2),
        "breath": (1, 3.0, 0.5),  # the sigh
        "nod": (1, 0.9, 0.3),
        "start": (0, 1.2, 0.3),  # the sigh itself
        "swing": (1, 0.9, 0.2),
        "cadence": (1, 0.92, 0.04),
    },
    "sadness": {
        "slump": (0, 21, 7),  # W G M: collapsed
        "lean": (0, 4, 5),
        "head": (0, 24, 8),  # W R G: head down
        "aside": (4, 8, 6),
        "tilt": (3, 7, 4),
        "shrug": (0, -0.012, 0.01),
        "reach": (1, 0.55, 0.12),  # W P: small
        "height": (0, -0.09, 0.05),
        "width": (0, -10, 7),
        "tempo": (1, 0.55, 0.09),  # P R A V: slow
        "rate": (0.4, 0.17, 0.08),
        "jerk": (0.2, 0.05, 0.05),  # N P: smooth
        "hold": (1, 2.1, 0.4),
        "emblem": (0.05, 0.75, 0.15),
        "trunk": (0.35, 0.25, 0.15),
        "sway": (1, 0.85, 0.2),
        "breath": (1, 1.35, 0.3),
        "nod": (1, 0.6, 0.15),
        "swing": (1, 0.4, 0.15),  # R C H, Michalak et al. 2009
        "cadence": (1, 0.84, 0.05),  # G C
        "stride": (1, 0.8, 0.06),
    },
    "shame": {
        "slump": (0, 15, 6),  # W T: collapsed, shrinking
        "lean": (0, 2, 5),
        "head": (0, 26, 8),  # W T: head down
        "aside": (4, 23, 9),  # averted
        "tilt": (3, 7, 4),
        "shrug": (0, 0.02, 0.015),
        "reach": (1, 0.55, 0.12),
        "height": (0, -0.03, 0.05),
        "width": (0, -16, 7),
        "tempo": (1, 0.75, 0.12),
        "rate": (0.4, 0.22, 0.1),
        "jerk": (0.2, 0.12, 0.08),
        "hold": (1, 1.8, 0.4),
        "emblem": (0.05, 0.85, 0.12),
        "trunk": (0.35, 0.3, 0.15),
        "sway": (1, 1.1, 0.3),
        "nod": (1, 0.6, 0.2),
        "swing": (1, 0.5, 0.15),
        "cadence": (1, 0.9, 0.05),
        "stride": (1, 0.85, 0.06),
    },
    "surprise": {
        "slump": (0, -9, 5),  # A D: sudden upright, backward
        "lean": (0, -9, 5),
        "head": (0, -9, 6),
        "shrug": (0, 0.03, 0.015),
        "reach": (1, 1.35, 0.25),
        "height": (0, 0.14, 0.06),  # A: hands up
        "width": (0, 18, 10),
        "tempo": (1, 1.7, 0.2),
        "rate": (0.4, 0.45, 0.12),
        "jerk": (0.2, 0.6, 0.15),
        "hold": (1, 1.4, 0.3),
        "emblem": (0.05, 0.85, 0.12),
        "trunk": (0.35, 0.65, 0.2),
        "breath": (1, 1.4, 0.3),
        "nod": (1, 1.3, 0.3),
        "start": (0, 1.2, 0.25),
        "swing": (1, 1.0, 0.2),
        "stride": (1, 0.95, 0.06),
    },
}
"""See the module's docstring."""
