"""What hatch does when it builds a wheel: compile the kernels for this platform, and put them in.

An installation of the sources in place gets them beside the sources. Where they can't be compiled the installation goes
on without: numba then compiles each kernel when it is called first. Nothing in the package imports this module.
"""

from __future__ import annotations

import subprocess
import sys
import sysconfig
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class MachineCode(BuildHookInterface):
    """The hook; hatch finds it by its base class."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Called before a wheel is put together."""
        sys.path.insert(0, self.root)
        try:
            from curveline.kernels.build import build
            from curveline.kernels.object_file import files, library

            if library() is None:  # made before, of other sources, or never
                self.app.display_info("compiling kernels, about a minute")
                build()
        except (ImportError, OSError, subprocess.CalledProcessError) as error:  # ImportError: numba is not there
            self.app.display_warning(f"kernels are left to be compiled when they are called: {error}")
            return
        if version != "editable":
            build_data["artifacts"] += [f"{file.relative_to(self.root)}" for file in files()]
            build_data["pure_python"] = False
            build_data["tag"] = f"py3-none-{_platform()}"


def _platform() -> str:
    return sysconfig.get_platform().replace("-", "_").replace(".", "_")
