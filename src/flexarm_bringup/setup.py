from pathlib import Path

from setuptools import find_packages, setup

NAME = "flexarm_bringup"


def shared(folder: str) -> list[tuple[str, list[str]]]:
    """Return every file below a folder, in the same layout below share/."""
    files = [
        path for path in sorted(Path(folder).rglob("*")) if path.is_file() and "__pycache__" not in path.parts
    ]
    return [(f"share/{NAME}/{path.parent}", [str(path)]) for path in files]


setup(
    name=NAME,
    version="0.1.0",
    packages=find_packages(include=[NAME, f"{NAME}.*"]),
    py_modules=["flexarm_pytest"],
    package_data={NAME: ["**/*.html", "**/*.css", "**/*.js", "**/*.json", "**/*.csv", "**/*.yaml", "**/*.c"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        *shared("launch"),
        *shared("config"),
    ],
    install_requires=["setuptools"],
    extras_require={"test": ["pytest"]},
    zip_safe=False,
    maintainer="flexarm developers",
    maintainer_email="flexarm@example.com",
    description="The flexarm command, simulated rig, bags, reports, launch files and manipulators.",
    license="Apache-2.0",
    entry_points={
        "console_scripts": [
            "commander_node = flexarm_bringup.executables:commander_node",
            "composed_node = flexarm_bringup.executables:composed_node",
            "excite_node = flexarm_bringup.executables:excite_node",
            "markers_node = flexarm_bringup.executables:markers_node",
            "recorder_node = flexarm_bringup.executables:recorder_node",
            "rig_node = flexarm_bringup.executables:rig_node",
            "flexarm = flexarm_bringup.cli:main",
        ],
        "pytest11": ["flexarm_regress = flexarm_pytest"],
    },
)
