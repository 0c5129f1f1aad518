"""What training minimises, and the optimizer that does it."""

import torch
from torch import Tensor

from fervor_export.network import Network
from fervor_export.recipe import Recipe


def make_optimizer(network: Network, recipe: Recipe) -> torch.optim.Optimizer:
    """A recipe's optimizer of a network's weights."""
    parameters = [parameter for parameter in network.parameters() if parameter.requires_grad]
    if recipe.optimizer == "adamw":
        return torch.optim.AdamW(parameters, recipe.learning_rate, weight_decay=recipe.weight_decay)
    # Keras' constants, as the paper names none: torch smooths ten times longer and damps less.
    return torch.optim.RMSprop(parameters, recipe.learning_rate, alpha=0.9, eps=1e-7, weight_decay=recipe.weight_decay)


def loss(predicted: Tensor, target: Tensor, weight: Tensor, ccc_weight: float) -> Tensor:
    """Mean absolute error and 1 - CCC of predictions, all of one shape, each frame by its weight."""
    share = weight / weight.sum().clamp_min(1e-12)
    error = ((predicted - target).abs() * share).sum()
    if not ccc_weight:
        return error
    mean_p, mean_t = (predicted * share).sum(), (target * share).sum()
    off_p, off_t = predicted - mean_p, target - mean_t
    scale = (off_p.square() * share).sum() + (off_t.square() * share).sum() + (mean_p - mean_t).square()
    ccc = 2 * (off_p * off_t * share).sum() / scale.clamp_min(1e-6)
    return (1 - ccc_weight) * error + ccc_weight * (1 - ccc)
