"""What the analysis of a study says: plain values, the same for terminal, JSON and HTML."""

from dataclasses import dataclass

from fervor_pepper.study.sphericity import Sphericity


@dataclass(frozen=True, slots=True)
class Condition:
    """How one condition was rated."""

    name: str
    mean: float
    sd: float
    low: float
    """Ends of the 95 % interval within participants (Cousineau 2005, Morey 2008)."""
    high: float


@dataclass(frozen=True, slots=True)
class Anova:
    """One-way repeated-measures ANOVA."""

    f: float
    df_conditions: int
    df_error: int
    p: float
    """As if spherical."""
    p_corrected: float
    """Degrees of freedom times the Greenhouse-Geisser epsilon."""
    partial_eta2: float
    generalised_eta2: float
    """Olejnik & Algina 2003."""


@dataclass(frozen=True, slots=True)
class Pair:
    """Two conditions compared by a paired t test."""

    first: str
    second: str
    difference: float
    """Mean of first minus second, points of the scale."""
    low: float
    """Ends of its 95 % interval, not corrected."""
    high: float
    t: float
    df: int
    p: float
    p_bonferroni: float
    d: float
    """Cohen's d: the difference over the mean standard deviation of both."""
    d_z: float
    """The difference over its own standard deviation."""


@dataclass(frozen=True, slots=True)
class Assumptions:
    """What the ANOVA takes for granted."""

    shapiro_w: float | None
    """Shapiro-Wilk test of the residuals."""
    shapiro_p: float | None
    rank_test: str
    """Friedman or Wilcoxon: what it would be without them."""
    rank_p: float | None


@dataclass(frozen=True, slots=True)
class ScaleResult:
    """One scale, compared between conditions."""

    scale: str
    participants: tuple[str, ...]
    """Those with answers in every condition."""
    scores: tuple[tuple[float, ...], ...]  # [participant, condition]
    conditions: tuple[Condition, ...]
    anova: Anova
    sphericity: Sphericity
    pairs: tuple[Pair, ...]
    assumptions: Assumptions

    @property
    def p(self) -> float:
        """The one to report: corrected where sphericity is violated."""
        return self.anova.p_corrected if self.sphericity.violated else self.anova.p


@dataclass(frozen=True, slots=True)
class StudyResult:
    """A whole study."""

    conditions: tuple[str, ...]
    scales: tuple[ScaleResult, ...]
    notes: tuple[str, ...]
    """What is odd or missing, and what could not be done."""
