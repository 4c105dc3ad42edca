from setuptools import find_packages, setup

NAME = "flexarm_estimator"

setup(
    name=NAME,
    version="0.1.0",
    packages=find_packages(include=[NAME, f"{NAME}.*"]),
    package_data={
        NAME: ["**/*.html", "**/*.css", "**/*.js", "**/*.json", "**/*.csv", "**/*.yaml", "**/*.c", "**/*.h"]
    },
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
    ],
    install_requires=["setuptools"],
    extras_require={"test": ["pytest"]},
    zip_safe=False,
    maintainer="flexarm developers",
    maintainer_email="flexarm@example.com",
    description="State of a flexible arm from encoders, strain gauges, accelerometers and a camera.",
    license="Apache-2.0",
    entry_points={
        "console_scripts": [
            "estimator_node = flexarm_estimator.executables:estimator_node",
            "drift_node = flexarm_estimator.executables:drift_node",
        ],
    },
)
