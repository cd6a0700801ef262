"""The help of every command, as the command line prints it."""

from __future__ import annotations


def command_page() -> str:
    """Page with the help of all commands."""
    import click

    from fibrefit.cli.main import COMMANDS, group

    lines = [
        "# Commands",
        "",
        "What `--help` prints. Exit codes: 0 good, 1 fault of the program, 2 usage, 3 data not understood, 4 study not "
        "valid, 5 the result failed its checks, 130 interrupted.",
        "",
    ]
    parent = click.Context(group, info_name="fibrefit", max_content_width=100, terminal_width=100)
    for name in COMMANDS:
        command = group.get_command(parent, name)
        if command is None:
            continue
        context = click.Context(
            command,
            info_name=name,
            parent=parent,
            max_content_width=100,
            terminal_width=100,
            help_option_names=["-h", "--help"],
        )
        lines += [f"## {name}", "", COMMANDS[name], "", "```text", command.get_help(context), "```", ""]
    return "\n".join(lines)
