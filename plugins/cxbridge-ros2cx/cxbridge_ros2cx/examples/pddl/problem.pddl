{# a template: the rooms are in a row #}
{% set rooms = ["hall", "kitchen", "cellar"] %}
(define (problem home)
  (:domain rooms)
  (:objects {{ rooms | join(" ") }} - room)
  (:init (at hall){% for room in rooms[1:] %} (door {{ rooms[loop.index0] }} {{ room }}){% endfor %})
  (:goal (at hall)))
