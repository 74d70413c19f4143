#!/usr/bin/env bash
# nidaqmx over gRPC: registering an event blocks until the server has sent metadata, without a limit.
#
# Expected: an event is registered by a short call; the wait for events is in a thread of its own.
# Seen: register_every_n_samples_acquired_into_buffer_event() waits in the caller's thread for the initial metadata
#     of the event stream. gRPC servers in Python send it with the first message unless told otherwise, so a server
#     that only yields events holds the caller until the first event. That comes after start(), which the caller
#     cannot reach. With send_initial_metadata() at once the call returns at once.
# Versions: nidaqmx 1.7.0, grpcio 1.85.3.
# Who is hurt: writers of simulated cards, proxies and recorders for NI's gRPC service: their event methods follow
#     the service description, and every client hangs before its first sample.
set -euo pipefail

folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check \
  "nidaqmx[grpc]==1.7.0" \
  "grpcio==1.85.3"
cat >finding.py <<'EOF'
import time
from concurrent import futures
from importlib.metadata import version

import grpc
import nidaqmx
from nidaqmx._stubs import nidaqmx_pb2 as messages
from nidaqmx._stubs import nidaqmx_pb2_grpc as service

FIRST_EVENT_AFTER_S = 3.0


class Server(service.NiDAQmxServicer):
    """Events that come after some seconds; the metadata comes with the first of them, or at once."""

    def __init__(self, metadata_at_once: bool) -> None:
        self.metadata_at_once = metadata_at_once

    def CreateTask(self, request, context):
        task = {"name": request.session_name}
        return messages.CreateTaskResponse(task=task, new_session_initialized=True)

    def ClearTask(self, request, context):
        return messages.ClearTaskResponse()

    def GetTaskAttributeString(self, request, context):
        return messages.GetTaskAttributeStringResponse(value=request.task.name)

    def RegisterEveryNSamplesEvent(self, request, context):
        if self.metadata_at_once:
            context.send_initial_metadata(())
        time.sleep(FIRST_EVENT_AFTER_S)
        yield messages.RegisterEveryNSamplesEventResponse(n_samples=request.n_samples)


def seconds_to_register(metadata_at_once: bool) -> float:
    server = grpc.server(futures.ThreadPoolExecutor(4))
    service.add_NiDAQmxServicer_to_server(Server(metadata_at_once), server)
    port = server.add_insecure_port("127.0.0.1:0")
    server.start()
    with grpc.insecure_channel(f"127.0.0.1:{port}") as channel:
        options = nidaqmx.GrpcSessionOptions(channel, "task")
        with nidaqmx.Task("task", grpc_options=options) as task:
            began = time.monotonic()
            task.register_every_n_samples_acquired_into_buffer_event(100, lambda *_: 0)
            took = time.monotonic() - began
    server.stop(None)
    return took


print("nidaqmx", version("nidaqmx"), "grpcio", version("grpcio"))
late, at_once = seconds_to_register(False), seconds_to_register(True)
print(f"first event after {FIRST_EVENT_AFTER_S} s; registering took")
print(f"  {late:.1f} s where the metadata comes with the first event")
print(f"  {at_once:.1f} s where the server sends the metadata at once")
assert late > FIRST_EVENT_AFTER_S - 0.5 and at_once < FIRST_EVENT_AFTER_S / 2, "changed"
EOF
venv/bin/python finding.py
