# A daemon in a container: docs/installing.md says how to run it.
ARG PYTHON=3.13

FROM python:${PYTHON}-slim AS build
WORKDIR /source
COPY . .
# exactly the packages of requirements/, each by its hash
RUN python -m venv /opt/build \
 && /opt/build/bin/pip install --no-cache-dir --disable-pip-version-check --require-hashes -r requirements/build.txt \
 && for each in . plugins/cxbridge-fawkes plugins/cxbridge-planning plugins/cxbridge-protobuf plugins/cxbridge-robot-memory plugins/cxbridge-studio plugins/cxbridge-web; do \
      (cd "$each" && /opt/build/bin/python -m hatchling build -t wheel -d /wheel) || exit 1; done \
 && python -m venv /opt/cxbridge \
 && /opt/cxbridge/bin/pip install --no-cache-dir --disable-pip-version-check --require-hashes -r requirements/container.txt \
 && /opt/cxbridge/bin/pip install --no-cache-dir --disable-pip-version-check --no-deps /wheel/*.whl

FROM python:${PYTHON}-slim
# cxbridge itself is GPL-2.0-or-later; with pyperplan in it the whole is under GPL-3. See docs/evidence/dependencies.md.
LABEL org.opencontainers.image.title="cxbridge" \
      org.opencontainers.image.licenses="GPL-3.0-or-later"
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
