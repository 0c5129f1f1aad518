"""The training side of fervor: data, network, training, evaluation, export to ONNX."""
