"""Bodies that come from another finite-element program as sparse matrices.

files (``matrix_file``, ``mesh_files``) -> ``FeModel`` in SI and body axes -> ``check_model`` -> interface
nodes as a constraint matrix -> Guyan or Craig-Bampton -> volume integrals -> ``Superelement``.
"""
