"""A verb that is a group of verbs, of which one needs no name."""

from __future__ import annotations

from typer.core import TyperGroup


class FitUnlessNamed(TyperGroup):
    """`asflown VERB FILE` is `asflown VERB fit FILE`: what is no verb of the group is a file or an option of the fit."""

    def parse_args(self, ctx, args):
        if args and args[0] not in self.commands and args[0] != "--help":
            args = ["fit", *args]
        return super().parse_args(ctx, args)
