#!/usr/bin/env bash
# nidaqmx over gRPC: the timeout of read() is no deadline; the client waits as long as the server does.
#
# Expected: task.read(timeout=0.5) returns or raises after about half a second.
# Seen: over gRPC the number is only a field of the request. The call itself has no deadline, so a server that
#     answers after 4 s keeps the caller for 4 s, and no error follows. The server here is made from the service that
#     the package ships; it stands for a busy server, or a card that hangs.
# Versions: nidaqmx 1.7.0, grpcio 1.85.3.
# Who is hurt: control loops and interlocks that rely on the timeout to notice that no readings arrive. With high
#     voltage on the output they need a deadline of their own.
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

TIMEOUT_S, ANSWER_AFTER_S = 0.5, 4.0
CHANNEL_TYPE = 6271  # the attribute ChanType; its value for an analog input is 10100
ANALOG_INPUT, VOLTAGE = 10100, 10322


class SlowServer(service.NiDAQmxServicer):
    """One task with one analog input, whose reading comes late."""

    def CreateTask(self, request, context):
        task = {"name": request.session_name}
        return messages.CreateTaskResponse(task=task, new_session_initialized=True)

    def ClearTask(self, request, context):
        return messages.ClearTaskResponse()

    def CreateAIVoltageChan(self, request, context):
        return messages.CreateAIVoltageChanResponse()

    def GetTaskAttributeString(self, request, context):
        return messages.GetTaskAttributeStringResponse(value="force")

    def GetReadAttributeString(self, request, context):
        return messages.GetReadAttributeStringResponse(value="force")

    def GetReadAttributeUInt32(self, request, context):
        return messages.GetReadAttributeUInt32Response(value=1)

    def GetChanAttributeInt32(self, request, context):
        value = ANALOG_INPUT if request.attribute_raw == CHANNEL_TYPE else VOLTAGE
        return messages.GetChanAttributeInt32Response(value_raw=value)

    def ReadAnalogF64(self, request, context):
        self.asked_s, self.deadline_s = request.timeout, context.time_remaining()
        time.sleep(ANSWER_AFTER_S)
        return messages.ReadAnalogF64Response(read_array=[1.25], samps_per_chan_read=1)


servicer = SlowServer()
server = grpc.server(futures.ThreadPoolExecutor(4))
service.add_NiDAQmxServicer_to_server(servicer, server)
port = server.add_insecure_port("127.0.0.1:0")
server.start()
with grpc.insecure_channel(f"127.0.0.1:{port}") as channel:
    options = nidaqmx.GrpcSessionOptions(channel, "task")
    with nidaqmx.Task("task", grpc_options=options) as task:
        task.ai_channels.add_ai_voltage_chan("Dev1/ai0", "force")
        began = time.monotonic()
        value = task.read(timeout=TIMEOUT_S)
        took_s = time.monotonic() - began
server.stop(None)

print("nidaqmx", version("nidaqmx"), "grpcio", version("grpcio"))
print(f"asked with a timeout of {TIMEOUT_S} s; the server saw {servicer.asked_s} s in the request")
print("deadline of the call:", "none" if servicer.deadline_s > 1e9 else f"{servicer.deadline_s} s")
print(f"read() returned {value} after {took_s:.1f} s, without an error")
assert servicer.asked_s == TIMEOUT_S and servicer.deadline_s > 1e9, "changed"
assert value == 1.25 and took_s >= ANSWER_AFTER_S, "changed"
EOF
venv/bin/python finding.py
