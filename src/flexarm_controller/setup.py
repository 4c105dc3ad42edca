from setuptools import find_packages, setup

NAME = "flexarm_controller"

setup(
    name=NAME,
    version="0.1.0",
    packages=find_packages(include=[NAME, f"{NAME}.*"]),
    package_data={NAME: ["**/*.html", "**/*.css", "**/*.js", "**/*.json", "**/*.csv", "**/*.yaml", "**/*.c"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
    ],
    install_requires=["setuptools"],
    extras_require={"test": ["pytest"]},
    zip_safe=False,
    maintainer="flexarm developers",
    maintainer_email="flexarm@example.com",
    description="Model predictive control of a flexible arm on its served model, with fallbacks and a guard.",
    license="Apache-2.0",
    entry_points={
        "console_scripts": [
            "controller_node = flexarm_controller.executables:controller_node",
            "guard_node = flexarm_controller.executables:guard_node",
        ],
    },
)
