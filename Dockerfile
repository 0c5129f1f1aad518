# The service alone: no torch, no compiler, no root. Build: docker build -t fervor .
# PYTHON names the base image, so that a mirror or a newer patch release can be used.
ARG PYTHON=python:3.11-slim

FROM ${PYTHON} AS build
WORKDIR /src
RUN python -m venv --without-pip /opt/fervor
COPY constraints.txt pyproject.toml README.md LICENSE ./
COPY service service
COPY export export
COPY clients/python clients/python
COPY clients/pepper clients/pepper
COPY bench/fervor_bench bench/fervor_bench
COPY clients/js/src clients/js/src
COPY page page
# The live page, unless it came with the sources; without it, and without a network to build it, the service runs as well.
RUN test -f service/fervor/server/page_files/index.html \
 || { python -m venv /opt/node && PYTHON=/opt/node/bin/python page/make; } \
 || echo "the image has no live page"
# Compiled here once: the container can't write, and a replica that comes back should not spend its start on it.
RUN python -m pip --python /opt/fervor/bin/python install --no-cache-dir --disable-pip-version-check \
      --constraint constraints.txt '.[serve]' \
 && find /opt/fervor -depth \( -name tests -o -name test \) -type d -exec rm -rf {} +

FROM ${PYTHON}
LABEL org.opencontainers.image.title="fervor" \
      org.opencontainers.image.description="Live emotional intensity from body poses, for robots" \
      org.opencontainers.image.licenses="Apache-2.0"
COPY --from=build /opt/fervor /opt/fervor
ENV PATH=/opt/fervor/bin:$PATH PYTHONDONTWRITEBYTECODE=1 PYTHONUNBUFFERED=1 ORT_DISABLE_TELEMETRY=1 \
    FERVOR_HOST=0.0.0.0 FERVOR_PORT=8080
USER 65532:65532
EXPOSE 8080
STOPSIGNAL SIGTERM
HEALTHCHECK --interval=5s --timeout=3s --start-period=60s \
  CMD ["python", "-c", "import os, urllib.request as r; r.urlopen(f'http://127.0.0.1:{os.environ[\"FERVOR_PORT\"]}/readyz', timeout=2)"]
ENTRYPOINT ["fervor"]
CMD ["serve"]
