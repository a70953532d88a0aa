{# A template of jinja2: the rooms are in a row. PDDL requires a goal, but agents set their own goals. #}
{% set rooms = ["hall", "kitchen", "cellar"] %}
(define (problem home)
  (:domain rooms)
  (:objects {{ rooms | join(" ") }} - room)
  (:init (at hall){% for room in rooms[1:] %} (door {{ rooms[loop.index0] }} {{ room }}){% endfor %})
  (:goal (at hall)))
