"""The arm for a viewer: URDF with segment joints, markers of the bent links."""
