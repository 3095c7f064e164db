# SPDX-License-Identifier: BSD-3-Clause
"""The recipe for conda and package.xml for ROS 2: read by what reads them there, and held against pyproject.toml.

    package_forms.py SOURCE_DIR      by a Python that has catkin_pkg and py-rattler-build
"""
import pathlib
import sys
import tomllib

import rattler_build
from catkin_pkg.package import parse_package

SOURCE = pathlib.Path(sys.argv[1])
PYTHONS = ['3.10', '3.11', '3.12', '3.13']


def main():
    project = tomllib.loads((SOURCE / 'pyproject.toml').read_text())['project']
    warnings = []
    package = parse_package(SOURCE / 'package.xml', warnings=warnings)  # raises what format 3 does not allow
    assert not warnings, warnings
    assert (package.package_format, package.get_build_type()) == (3, 'cmake'), package
    assert (package.name, package.version) == (project['name'], project['version']), package
    assert package.licenses == [project['license']['text']], package.licenses

    recipe = rattler_build.Stage0Recipe.from_file(SOURCE / 'packaging' / 'recipe.yaml')
    variants = rattler_build.VariantConfig({'python': PYTHONS})
    rendered = recipe.render(variants, rattler_build.RenderConfig(rattler_build.PlatformConfig(target_platform='linux-64')))
    assert sorted(one.variant['python'] for one in rendered) == PYTHONS, rendered
    for one in rendered:
        conda = one.recipe
        assert (conda.package.name, str(conda.package.version)) == (project['name'], project['version']), conda.package
        assert conda.about.license == project['license']['text'], conda.about
    print(f'package_forms: package.xml is of format 3, the recipe renders for Python {", ".join(PYTHONS)}')


main()
