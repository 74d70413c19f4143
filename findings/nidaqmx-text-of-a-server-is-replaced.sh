#!/usr/bin/env bash
# nidaqmx over gRPC: the server's own explanation is replaced for two status codes.
#
# Expected: the text of a server's status reaches the person who reads the error, as gRPC intends.
# Seen: for UNAVAILABLE nidaqmx says "Failed to connect to server", although the server answered and said why; for
#     UNIMPLEMENTED it says that NI's server must be upgraded. The server's text is only in the __context__ of the
#     error, which the traceback does not show. Other codes keep the text.
# Versions: nidaqmx 1.7.0, grpcio 1.85.3.
# Who is hurt: operators behind a gateway or a server that refuses for a reason ("the safety circuit is open", "the
#     rig is reserved"): they look for a network fault.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check \
  "nidaqmx[grpc]==1.7.0" \
  "grpcio==1.85.3"
cat >finding.py <<'EOF'
from concurrent import futures
from importlib.metadata import version

import grpc
import nidaqmx
from nidaqmx._stubs import nidaqmx_pb2_grpc as service

TEXT = "rig reserved until 14:00"


class Refusing(service.NiDAQmxServicer):
    code = grpc.StatusCode.UNAVAILABLE

    def CreateTask(self, request, context):
        context.abort(self.code, TEXT)


servicer = Refusing()
server = grpc.server(futures.ThreadPoolExecutor(2))
service.add_NiDAQmxServicer_to_server(servicer, server)
port = server.add_insecure_port("127.0.0.1:0")
server.start()
print("nidaqmx", version("nidaqmx"), "grpcio", version("grpcio"))
print(f"the server answers: {TEXT}")
shown = {}
with grpc.insecure_channel(f"127.0.0.1:{port}") as channel:
    for code in ("UNAVAILABLE", "UNIMPLEMENTED", "RESOURCE_EXHAUSTED", "FAILED_PRECONDITION"):
        servicer.code = grpc.StatusCode[code]
        try:
            nidaqmx.Task("task", grpc_options=nidaqmx.GrpcSessionOptions(channel, "task"))
        except nidaqmx.errors.RpcError as error:
            shown[code], hidden = " ".join(str(error).split()), error.__context__.details()
            print(f"  {code}: {shown[code]!r}; in __context__: {hidden!r}")
            assert hidden == TEXT and error.__suppress_context__, "changed"
server.stop(None)
assert "Failed to connect" in shown["UNAVAILABLE"] and TEXT not in shown["UNAVAILABLE"], "changed"
assert "Upgrade" in shown["UNIMPLEMENTED"] and TEXT not in shown["UNIMPLEMENTED"], "changed"
assert TEXT in shown["RESOURCE_EXHAUSTED"] and TEXT in shown["FAILED_PRECONDITION"], "changed"
EOF
venv/bin/python finding.py
