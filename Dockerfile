# A daemon in a container: docs/installing.md says how to run it.
ARG PYTHON=3.13

FROM python:${PYTHON}-slim AS build
WORKDIR /source
COPY . .
RUN python -m venv /opt/cxbridge \
 && /opt/cxbridge/bin/pip install --no-cache-dir --disable-pip-version-check '.[protobuf]'

FROM python:${PYTHON}-slim
RUN useradd --system --create-home --home-dir /var/lib/cxbridge cxbridge
COPY --from=build /opt/cxbridge /opt/cxbridge
ENV PATH=/opt/cxbridge/bin:$PATH PYTHONUNBUFFERED=1
USER cxbridge
WORKDIR /var/lib/cxbridge
# the blackboard (ZeroMQ), Fawkes' tools, the web: closed until the configuration opens them beyond the loopback
EXPOSE 1911 1910 8088
STOPSIGNAL SIGTERM
HEALTHCHECK --interval=10s --timeout=5s --start-period=20s --retries=3 CMD ["cxbridge", "daemon", "status"]
ENTRYPOINT ["cxbridge"]
CMD ["daemon"]
